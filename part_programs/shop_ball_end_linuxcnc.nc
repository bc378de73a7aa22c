(dialect: linuxcnc)
(Ball end of radius 12 on a neck)
(Face of the part at Z0, chuck at smaller Z, X is a diameter)
G21 G18 G40 G80 G90 G95 G7
T1 M6
G96 S180 D2500 M3
O100 SUB
G0 X0
G1 Z0
G3 X24 Z-12 R12
G1 Z-22
X36 Z-28
X42
O100 ENDSUB
G0 X42 Z2
F0.2
G71 Q100 D0.15 I1.5 R0.5
F0.1
G70 Q100 X42 Z2
G0 X60 Z30
M30
