"""The configuration file (contract: "Configuration file"): ``document`` reads it and checks its form, ``importing`` applies it in one
transaction, ``exporting`` writes it."""
from app.services.configuration.document import FORMAT
from app.services.configuration.exporting import export_configuration
from app.services.configuration.importing import import_configuration

__all__ = ["FORMAT", "export_configuration", "import_configuration"]
