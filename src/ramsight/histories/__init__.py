"""How machines change over months: a record a log, kept in a database, with trends, causes and a fleet's page."""
