"""OPC UA with the names of OPC 40502."""
