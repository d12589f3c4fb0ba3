"""The root of the virtual machine: what of the host's own its tests need, in an archive.

They read it from memory. A file that the guest asked the host for would be a wait as long as the
host likes, and all that time the guest's clock would jump from one timer to the next.
"""
import pathlib
import re
import subprocess
import tarfile

PROGRAMS = ("daemon", "ctl", "tests/hil", "tests/contract")
COMMANDS = """/bin/sh busybox cat cp cut dmesg find grep head kmod ls lsmod mkdir mktemp modprobe mount mv rm
    rmdir sed seq setsid sleep timeout udevadm v4l2-ctl /usr/lib/systemd/systemd-udevd""".split()
MODULES = "configfs vivid uvcvideo vimc ftdi_sio raw_gadget dummy_hcd gpio-sim".split()
TREES = ("/etc/udev", "/etc/modprobe.d", "/usr/lib/modprobe.d", "/usr/lib/udev/rules.d", "/usr/share/libcamera")
FILES = ("/etc/group", "/etc/ld.so.cache", "/etc/nsswitch.conf", "/etc/passwd", "/usr/lib/udev/hwdb.bin",
         "/usr/lib/udev/v4l_id")
EMPTY = {"dev": 0o755, "mnt/hil": 0o755, "proc": 0o755, "root": 0o700, "run": 0o755,
         "sys": 0o755, "tmp": 0o1777, "var/tmp": 0o1777}


def command_path(name):
    found = subprocess.run(["sh", "-c", 'PATH=/usr/sbin:/usr/bin:/sbin:/bin; command -v "$1"', "sh", name],
                           stdout=subprocess.PIPE, text=True)
    return [found.stdout.strip()] if found.stdout.startswith("/") else []


def libraries(programs):
    """The libraries that these load, and the program that loads them."""
    said = subprocess.run(["ldd", *programs], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return re.findall(r"(?:=> |^\s+)(/\S+) \(0x", said.stdout, re.M)


def modules(machine):
    root = machine / "lib/modules"
    kernel = next(root.iterdir()).name
    said = subprocess.run(["modprobe", "-d", machine, "-S", kernel, "--show-depends", "--all", *MODULES],
                          stdout=subprocess.PIPE, text=True, check=True)
    return re.findall(r"^insmod (\S+)", said.stdout, re.M) + [str(path) for path in root.glob("*/modules.*")]


def tree(path):
    return [str(inside) for inside in pathlib.Path(path).rglob("*") if inside.is_file()]


def list_files(source, machine, build):
    programs = [str(path) for directory in PROGRAMS for path in (build / directory).iterdir()
                if path.is_file() and path.stat().st_mode & 0o100]
    for name in COMMANDS:
        programs += command_path(name)
    plugins = [path for found in libraries(programs) if "libcamera.so" in found
               for path in tree(pathlib.Path(found).resolve().parent / "libcamera")]
    own = [str(source / "tests/hil/guest_init")]
    for path in (build / "hil-pictures", source / "tests/hil/guest", source / "sim/scenes"):
        own += tree(path)
    system = [path for path in FILES if pathlib.Path(path).exists()] + [file for path in TREES for file in tree(path)]
    return {*programs, *libraries(programs + plugins), *plugins, *own, *system, *modules(machine)}


def add_empty(out, name, kind, mode=0o777, target=""):
    entry = tarfile.TarInfo(name)
    entry.type, entry.mode, entry.linkname = kind, mode, target
    out.addfile(entry)


def pack(source, machine, build, archive):
    """Each file under the name that it is asked for by, but for links to directories, which are
    followed; those of the top, /lib and such, are there too."""
    names = {pathlib.Path(path).parent.resolve() / pathlib.Path(path).name for path in list_files(source, machine, build)}
    parents = {parent for name in names for parent in name.parents} - {pathlib.Path("/")}
    with tarfile.open(archive, "w", dereference=True) as out:
        for path in sorted(pathlib.Path("/").iterdir()):
            if path.is_symlink() and path.is_dir():
                add_empty(out, path.name, tarfile.SYMTYPE, target=str(path.readlink()))
        for path in sorted(parents):
            out.add(path, recursive=False)
        for name, mode in EMPTY.items():
            add_empty(out, name, tarfile.DIRTYPE, mode)
        for path in sorted(names):
            out.add(path)
