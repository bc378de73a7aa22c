"""The campaign of killed processes, full disks and read-only places: a whole file or none, and a next start that is well."""
