"""Run the command line as `python -m rigidimeter`."""

from rigidimeter.cli.main import main

if __name__ == "__main__":
    main()
