#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs scripts/demo --view for some minutes and takes a picture of its page as on a panel.
  picture.py FILE.png MINUTES"""
import pathlib
import sys
import time

from browser import Browser
from plant import demo


def main():
    file, minutes = pathlib.Path(sys.argv[1]), float(sys.argv[2])
    browser = Browser()
    with demo() as url:
        browser.look("panel")
        time.sleep(60 * minutes)
        browser.open(url)
        browser.until_text("#mode", "ACTIVE")
        browser.until_drawn()
        browser.picture(file, whole=False)
    browser.close()


if __name__ == "__main__":
    sys.exit(main())
