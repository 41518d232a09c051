"""Other groups' whole-body policies on our robot and our motions: OmniH2O, Exbody2 and HOVER (docs/baselines.md)."""
