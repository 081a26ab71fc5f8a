"""Typeset the article: `driver/paper/article.py` says how."""

from driver.paper.article import main

if __name__ == "__main__":
    main()
