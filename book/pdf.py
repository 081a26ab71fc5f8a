"""Print the built book as one PDF: `driver.paper.pdf` says how."""

import os

from driver.project import ENVIRONMENT

if __name__ == "__main__":
    os.environ |= ENVIRONMENT
    from driver.paper.pdf import main

    main()
