"""`zh golden`: did a change alter one bit of what the firmware computes?"""
