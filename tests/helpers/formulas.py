"""Cells that a spreadsheet would run as formulas, and how they are exported."""

_RUN = ["=1+1", "+1+1", "-2+3", "@ABS(A1)", "\t=1", "\r=1", "-cmd|' /C calc'!A0", "=HYPERLINK(1)"]
_RUN += ["＝1+1", "＋1+1", "－2+3", "＠A1", "'=1", "''+1+1"]
_KEPT = ["-1.5", "+2e-9", "-1,5", "-5%", "-", "1=1", "'5", "steel"]
CELLS = _RUN + _KEPT
INERT = {cell: f"'{cell}" for cell in _RUN} | {cell: cell for cell in _KEPT}
