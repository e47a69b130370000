"""Exit with 0 when a Vulkan device answers, with 1 and the reason when none does.

Standard library only: it runs before anything is built or installed.
"""

import ctypes
import sys


class InstanceCreateInfo(ctypes.Structure):
    """VkInstanceCreateInfo with no application info, layers or extensions."""

    _fields_ = [
        ("s_type", ctypes.c_int32),
        ("next", ctypes.c_void_p),
        ("flags", ctypes.c_uint32),
        ("application", ctypes.c_void_p),
        ("layer_count", ctypes.c_uint32),
        ("layers", ctypes.c_void_p),
        ("extension_count", ctypes.c_uint32),
        ("extensions", ctypes.c_void_p),
    ]


def main() -> str | None:
    """Why no device answers, or None."""
    library = "libvulkan.dylib" if sys.platform == "darwin" else "libvulkan.so.1"
    try:
        vulkan = ctypes.CDLL(library)
    except OSError:
        return "no Vulkan loader (" + library + ")"
    info = InstanceCreateInfo(s_type=1)
    instance = ctypes.c_void_p()
    if vulkan.vkCreateInstance(ctypes.byref(info), None, ctypes.byref(instance)) != 0:
        return "the Vulkan loader finds no driver"
    count = ctypes.c_uint32()
    result = vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    return None if result == 0 and count.value > 0 else "the Vulkan loader finds no device"


sys.exit(main())
