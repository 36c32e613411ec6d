"""Gives a linear body inertia by its lowest natural modes: jelly wobbles (science 3.14).

Terms:
    mode: Natural mode of vibration with an angular frequency [rad/s].
    shape: Displacement of the surface by a mode, normalised as in `Modes` [sqrt(m/N)].
    static amplitude: Amplitude at which a mode is in equilibrium with the forces [sqrt(N m)].
    deviation: Amplitude of a mode less its static amplitude [sqrt(N m)].
    swing: Displacement of the surface by the deviations of all modes [m].
    felt: Share of the swing that hands feel, 0 to 1; users see all of it.
    along: Static amplitude of each mode per unit force of a load [sqrt(m/N)].
"""
