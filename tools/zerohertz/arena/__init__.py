"""Estimators against each other, in the same drive on the same plants."""
