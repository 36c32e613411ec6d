"""Ten thousand rooms on four hundred machines: what people notice, from measured costs."""
