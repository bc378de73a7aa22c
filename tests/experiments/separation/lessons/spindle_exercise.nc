(A spindle through its speeds, up and down, with rests at each; the carriage waits in air)
G90 G94 G71 G18
G97 S150.0 M3
G1 Z4.0 F120.0
S2400.0 M3
Z0.0
S1200.0 M3
Z4.0
S300.0 M3
Z0.0
S150.0 M3
Z4.0
S1800.0 M3
Z0.0
S2400.0 M3
Z4.0
S600.0 M3
Z0.0
M5
M30
