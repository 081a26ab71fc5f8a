"""Make the editions for a course: `driver.course.course` says how."""

import os

from driver.project import ENVIRONMENT

if __name__ == "__main__":
    os.environ |= ENVIRONMENT
    from driver.course.course import main

    main()
