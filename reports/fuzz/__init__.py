"""Wrong input on purpose: valid files and command lines, damaged at random, given to the readers.

Whatever comes in must be read, or be refused by one of iapb's own errors; never a traceback, a hang, or memory without
end. `kinds` says what is damaged and who reads it, `mutate` how, `trial` tries cases and judges them.

    python -m reports.fuzz --cases 100000      (make fuzz)
"""

from reports.fuzz.trial import Broken, FuzzRecord, fuzz

__all__ = ["Broken", "FuzzRecord", "fuzz"]
