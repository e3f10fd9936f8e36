"""Design of the observer gain table: LMI, closed form, pole shift, zero; json and C."""
