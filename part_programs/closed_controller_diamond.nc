(G2 of Tiwari et al. 2023: a diamond of twenty segments of 12 mm, 6 mm/s)
(Lathe words: X moves the X slide, Z the Y slide; one second of rest at the end)
G18 G90 G94 G21 G8
G1 X12.0 F360
G1 Z12.0
G1 X24.0
G1 Z24.0
G1 X36.0
G1 Z36.0
G1 X24.0
G1 Z48.0
G1 X12.0
G1 Z60.0
G1 X0.0
G1 Z48.0
G1 X-12.0
G1 Z36.0
G1 X-24.0
G1 Z24.0
G1 X-12.0
G1 Z12.0
G1 X0.0
G1 Z0.0
G4 P1
M2
