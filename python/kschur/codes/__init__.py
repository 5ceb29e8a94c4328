"""Problems out of the models of other codes, where these do not give matrices in a few lines: docs/recipes.md."""
from .exudyn import from_exudyn
from .opensees import from_opensees

__all__ = ["from_exudyn", "from_opensees"]
