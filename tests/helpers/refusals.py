"""What is asked of every refusal, warning and interrupt: that it says what is wrong."""

import pytest

from pymoo_psi import PsiError


def refused(message, call, *args, error=PsiError, **options):
    """Require that a call is refused by an error of the package with such a message."""
    with pytest.raises(error, match=message) as caught:
        call(*args, **options)
    assert isinstance(caught.value, PsiError)


def flaw(call, *args, **options):
    """Return what the error of the package says that a call raises, or nothing if there is none."""
    try:
        call(*args, **options)
    except PsiError as error:
        return str(error)
    return ""


def warned(message, call, *args, **options):
    """Require that a call warns with such a message; return what it returns."""
    with pytest.warns(UserWarning, match=message):
        return call(*args, **options)


def interrupted(call, *args, message=None, **options):
    """Require that a call ends as if somebody pressed Ctrl-C, with such a message."""
    with pytest.raises(KeyboardInterrupt, match=message):
        call(*args, **options)
