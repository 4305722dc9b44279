"""`python -m app` is `fluidwarp`."""

from app.cli import main

main()
