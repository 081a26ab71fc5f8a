"""Make the material of a course: `driver/course/course.py` says what."""

from driver.course.course import main

if __name__ == "__main__":
    main()
