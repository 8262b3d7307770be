"""The live page: a simulation that people steer in a browser. The core knows no web; `server` and `page` need viser."""
