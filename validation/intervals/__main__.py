"""Coverage of the intervals of `fsm calibrate force`: ``python -m validation.intervals``."""

from validation.intervals.studies import main

if __name__ == "__main__":
    main()
