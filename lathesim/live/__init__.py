"""The live machine: sources and sinks of timed samples, streaming of set-points, the twin, the watch, OPC UA and MTConnect.

Only this room opens sockets.
"""
