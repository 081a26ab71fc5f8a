"""Print the built book as one PDF: `driver/paper/pdf.py` says how."""

from driver.paper.pdf import main

if __name__ == "__main__":
    main()
