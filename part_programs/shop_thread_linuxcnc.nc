(dialect: linuxcnc)
(Thread M30x2: turned, then cut with G76)
(Face of the part at Z0, chuck at smaller Z, X is a diameter)
G21 G18 G40 G80 G90 G95 G7
T1 M6
G96 S180 D2500 M3
O100 SUB
G0 X26
G1 X30 Z-1
Z-25
X42
O100 ENDSUB
G0 X42 Z2
F0.25
G71 Q100 D0.1 I2 R0.5
F0.12
G70 Q100 X42 Z2
G97 S400 M3
G0 X34 Z6
(the drive line is at X34: the crest lies at X30, the root at X27.546; I, J and K are diameters under G7)
G76 P2 Z-18 I-4 J0.6 K2.454 R2 Q30 H1
G0 X60 Z30
M30
