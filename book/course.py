"""Make the editions for a course: `driver.course.course` says how."""

from driver.course.course import main

if __name__ == "__main__":
    main()
