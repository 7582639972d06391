"""Gas in chambers against closed forms: ideal gas, flow, balloons, clamped discs, the inflated beam, and panels."""
