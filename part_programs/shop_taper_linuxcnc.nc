(dialect: linuxcnc)
(Taper: single passes with G90 and a finishing pass; written out by lathesim program --write)
G21 G18 G90 G91.1 G8 G40
T1 M6
G96 S180 D2500 M3
G0 X22 Z2
G0 X20 Z2
G95
G1 X20 Z-30 F0.25
G1 X22 Z-30
G0 X22 Z2
G0 X18 Z2
G1 X18 Z-24
G1 X22 Z-24
G0 X22 Z2
G0 X16 Z2
G1 X16 Z-16
G1 X22 Z-16
G0 X22 Z2
G0 X14 Z2
G1 X14 Z0 F0.1
G1 X20 Z-30
G1 X22 Z-30
G0 X30 Z30
M2
