"""`python -m app` is `fluidwarp`."""

from app.start import main

main()
