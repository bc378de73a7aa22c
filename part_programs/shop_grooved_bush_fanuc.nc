%
O1005 (dialect: fanuc)
(Bush with a groove: turned, then grooved with G75)
(Face of the part at Z0, chuck at smaller Z, X is a diameter)
G21 G18 G40 G80 G99
T0101
G50 S2500
G96 S150 M03
G00 X42. Z2.
G71 U2. R0.5
G71 P10 Q20 U0.3 W0.1 F0.25
N10 G00 X34.
G01 Z0 F0.12
X36. Z-1.
Z-30.
N20 X42.
G70 P10 Q20
G00 X44. Z-12.
G75 R0.3
G75 X28. Z-16. P1500 Q1500 F0.08
(the bottom and both walls, in one pass)
G01 X28. F0.06
Z-16.
X44.
G00 X60. Z30.
M30
%
