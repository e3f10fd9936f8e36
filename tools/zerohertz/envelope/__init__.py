"""`zh envelope`: does the drive hold on any inverter, motor, load and mission, drawn at random?"""
