"""The paper's thirteen experiments: predicates, figures, identification of the rig."""
