"""Guides: for users of pymoo, engineers, analysts, researchers, clusters; the method; a paper.

The texts are the Markdown files of this folder, below on the site of the documentation. Their
examples and commands run as tests of the package, as does `notebook.ipynb` beside them, which goes
from tests to a decision in Jupyter.

.. include:: pymoo_user.md
.. include:: engineer.md
.. include:: engineer_python.md
.. include:: analyst.md
.. include:: researcher.md
.. include:: cluster.md
.. include:: other_programs.md
.. include:: openmdao.md
.. include:: extending.md
.. include:: method.md
.. include:: paper.md
"""
