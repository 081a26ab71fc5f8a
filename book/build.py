"""Build the book: `driver.build` says how."""

from driver.build import main

if __name__ == "__main__":
    main()
