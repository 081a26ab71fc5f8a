"""Build the book: `driver.build` says how."""

import os

from driver.project import ENVIRONMENT

if __name__ == "__main__":
    os.environ |= ENVIRONMENT
    from driver.build import main

    main()
