(Roughing and finishing passes along a shaft of 44 mm, with steps of feed and depth. X is a radius; the tool cuts toward +Z)
G90 G95 G71 G18
G97 S1000.0 M3
G0 X21.0 Z13.0
G1 Z15.0 F0.2
Z22.0
Z28.0 F0.12
Z38.0 F0.3
G0 X23.0
Z13.0
S700.0 M3
G0 X19.6
G1 Z15.0 F0.15
Z20.0
Z32.0 F0.36
G0 X23.0
Z13.0
S1400.0 M3
G0 X19.2
G1 Z15.0 F0.08
Z19.0
Z30.0 F0.2
G0 X23.0
Z0.0
M5
M30
