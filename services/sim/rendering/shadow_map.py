"""The shadow map that pybullet's EGL plugin draws before each image, whether shadows are asked for
or not.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable

# OpenGL's own numbers: the registry's gl.xml.
_TEXTURE_2D = 0x0DE1
_TEXTURE_BINDING_2D = 0x8069
_TEXTURE_COMPARE_FUNC = 0x884D
_ALWAYS = 0x0207
_DEPTH_COMPONENT = 0x1902
_DEPTH_COMPONENT16 = 0x81A5
_FLOAT = 0x1406
_NO_PIXELS = (_DEPTH_COMPONENT, _FLOAT, None)
_FRAMEBUFFER = 0x8D40
_FRAMEBUFFER_BINDING = 0x8CA6
_DEPTH_ATTACHMENT = 0x8D00
_ATTACHMENT_OBJECT_TYPE = 0x8CD0
_ATTACHMENT_OBJECT_NAME = 0x8CD1
_TEXTURE = 0x1702
# The plugin makes one framebuffer, for its shadow map; drivers count from 1.
_MAX_FRAMEBUFFERS = 8


def shrink() -> int:
    """Make each shadow map of this thread's OpenGL context one pixel that shades nothing, and
    return how many there were.

    There is one once the plugin has drawn an image. It clears and draws its 4096 x 4096 pixels
    before each image; where the processor does that, it took half of an image's time.
    """
    gl = _OpenGL()
    bound_framebuffer = gl.integer(_FRAMEBUFFER_BINDING)
    bound_texture = gl.integer(_TEXTURE_BINDING_2D)
    maps = [gl.depth_texture(number) for number in range(1, _MAX_FRAMEBUFFERS + 1)]
    found = [texture for texture in maps if texture]

    for texture in found:
        gl.call("glBindTexture", _TEXTURE_2D, texture)
        gl.call("glTexImage2D", _TEXTURE_2D, 0, _DEPTH_COMPONENT16, 1, 1, 0, *_NO_PIXELS)
        gl.call("glTexParameteri", _TEXTURE_2D, _TEXTURE_COMPARE_FUNC, _ALWAYS)

    gl.call("glBindTexture", _TEXTURE_2D, bound_texture)
    gl.call("glBindFramebuffer", _FRAMEBUFFER, bound_framebuffer)
    return len(found)


class _OpenGL:
    """The functions of the OpenGL context that is current on this thread."""

    def __init__(self) -> None:
        egl = ctypes.CDLL("libEGL.so.1")
        self._address: Callable[[bytes], int | None] = egl.eglGetProcAddress
        egl.eglGetProcAddress.restype = ctypes.c_void_p

    def call(self, name: str, *arguments: int | ctypes.Array[ctypes.c_int] | None) -> int:
        """Call the function of that name; numbers are 32 bits wide."""
        address = self._address(name.encode())
        assert address is not None, name
        function = ctypes.CFUNCTYPE(ctypes.c_int)(address)
        result: int = function(*arguments)
        return result

    def integer(self, name: int) -> int:
        """Return a value of the context's state."""
        value = (ctypes.c_int * 1)()
        self.call("glGetIntegerv", name, value)
        return value[0]

    def depth_texture(self, framebuffer: int) -> int:
        """Return the texture that this framebuffer draws depth into; 0 if it does not.

        It stays bound.
        """
        if not self.call("glIsFramebuffer", framebuffer) & 0xFF:
            return 0

        self.call("glBindFramebuffer", _FRAMEBUFFER, framebuffer)
        if self._attachment(_ATTACHMENT_OBJECT_TYPE) != _TEXTURE:
            return 0
        return self._attachment(_ATTACHMENT_OBJECT_NAME)

    def _attachment(self, name: int) -> int:
        value = (ctypes.c_int * 1)()
        get = "glGetFramebufferAttachmentParameteriv"
        self.call(get, _FRAMEBUFFER, _DEPTH_ATTACHMENT, name, value)
        return value[0]
