"""Support for all parts of the package: the command line, errors, files, schemas, tables, threads and compilation."""
