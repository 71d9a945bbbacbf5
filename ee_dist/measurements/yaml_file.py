"""How a mapping is read, and its values shown."""

from ee_dist.basics.plain_yaml import load_yaml
from ee_dist.basics.quoted import quoted as shown

__all__ = ["load_yaml", "shown"]
