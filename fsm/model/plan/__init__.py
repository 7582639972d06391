"""Steps of a deployment, their times, and the reasons for steps in Python."""
