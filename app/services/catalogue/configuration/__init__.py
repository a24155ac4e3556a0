"""The configuration file (docs/interfaces.md): ``document`` reads it and checks its form, ``importing`` applies it in one
transaction, ``exporting`` writes it."""

from app.services.catalogue.configuration.document import FORMAT
from app.services.catalogue.configuration.exporting import export_configuration
from app.services.catalogue.configuration.importing import import_configuration, preview

__all__ = ["FORMAT", "export_configuration", "import_configuration", "preview"]
