%
O1004 (dialect: fanuc)
(Ball end of radius 12 on a neck)
(Face of the part at Z0, chuck at smaller Z, X is a diameter)
G21 G18 G40 G80 G99
T0101
G50 S2500
G96 S180 M03
G00 X42. Z2.
G71 U1.5 R0.5
G71 P10 Q20 U0.3 W0.1 F0.2
N10 G00 X0.
G01 Z0 F0.1
G03 X24. Z-12. R12.
G01 Z-22.
X36. Z-28.
N20 X42.
G70 P10 Q20
G00 X60. Z30.
M30
%
