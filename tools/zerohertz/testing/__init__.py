"""What `zh test` runs: stages, their scheduling, and the checks that no other tool offers."""
