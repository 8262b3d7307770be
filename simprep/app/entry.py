"""What the page's bare address answers: whoever draws without a graphics card is sent to half the resolution."""

import http

from websockets import Headers
from websockets.http11 import Request, Response

_ENTRY = b"""<!doctype html>
<html lang="en">
<title>simprep</title>
<script>
// names by which browsers call what draws without a graphics card
const software = /swiftshader|llvmpipe|softpipe|software|basic render/i;
let name = "";
const gl = document.createElement("canvas").getContext("webgl2");
if (gl) {
  const more = gl.getExtension("WEBGL_debug_renderer_info");
  name = gl.getParameter(more ? more.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  gl.getExtension("WEBGL_lose_context")?.loseContext();
}
location.replace(software.test(name) ? "/?fixedDpr=0.5" : "/?live");
</script>
<noscript>This page needs JavaScript.</noscript>
</html>
"""
"""A quarter of the pixels is drawn at 30 frames/s where all of them are not (`scripts/app_rates.py`); fixedDpr is viser's option."""


def entry(request: Request) -> Response | None:
    """The answer to a request for the bare address; None for any other one, web sockets among them."""
    if request.path != "/" or "Upgrade" in request.headers:
        return None
    headers = Headers(
        {"Content-Type": "text/html; charset=utf-8", "Content-Length": str(len(_ENTRY)), "Cache-Control": "no-store"}
    )
    return Response(http.HTTPStatus.OK, "OK", headers, _ENTRY)
