"""The haptic loop at 1 kHz: one period as a function, and the process that runs it.

Terms:
    sight: Surface sample: depth of the probe below a surface [m], the surface's normal, and the
        contact's compliance [m/N], at one position of the probe.
    shown: Surface of this period: it moves from the surface shown before to that of the newest
        patch.
    k_h: Gain K_h of the law, the stiffness between depth and normal force [N/m].
    c_ii: Compliance C_ii of the contact along its normal [m/N].
    budget: Largest change of the force in this period that the hand's motion does not cause [N].
    ledger: What each rule did to the force in this period [N].
    own: Largest change of the force in this period that the hand's motion explains [N].
    counted: Time since the last period, but at most two haptic periods [s].
    scale: Fraction of the requested force that the safety layer passes to the device, 0 to 1.
    engaged: A hand is engaged while it may feel force; after a fault the hand is released: the
        force falls to zero on a ramp, and the hand waits to be engaged again.
    silent: A server is silent if its newest patch is older than a limit [s].
"""
