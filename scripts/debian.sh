# SPDX-License-Identifier: MIT
# Debian's arm64 packages for scripts/image and scripts/packages, by an apt with lists of its own: the host
# gets neither another architecture nor a package from it. Source it after lib.sh.
debian=$root/build/debian

# debian_apt COMMAND…: apt-get or apt-cache, for arm64 and as if nothing was installed.
debian_apt() { APT_CONFIG=$debian/apt/conf "$@"; }

debian_update() {
    mkdir -p "$debian"/apt/{lists/partial,cache/archives/partial} && touch "$debian/apt/status"
    cat >"$debian/apt/conf" <<END
APT::Architecture "arm64"; APT::Architectures {"arm64";}; APT::Sandbox::User "$(id -un)";
APT::Install-Recommends "false"; Dir::State "$debian/apt"; Dir::State::status "$debian/apt/status";
Dir::Cache "$debian/apt/cache"; Acquire::Languages "none"; Acquire::Retries "3"; Debug::NoLocking "true";
END
    debian_apt apt-get -qq update
}

# debian_kernel: out: the package that linux-image-rt-arm64 stands for today.
debian_kernel() {
    debian_apt apt-cache depends linux-image-rt-arm64 | sed -n 's/.*Depends: \(linux-image-[0-9].*\)/\1/p'
}

# debian_closure PACKAGE…: out: their names and those of all that they depend on.
debian_closure() { debian_apt apt-get -s install "$@" | sed -n 's/^Inst \([^ ]*\) .*/\1/p'; }

# debian_fetch FOLDER PACKAGE…: these and no others; FOLDER/complete says that they are there.
debian_fetch() {
    local folder=$1
    shift
    mkdir -p "$folder"
    (cd "$folder" && debian_apt apt-get -qq download "$@")
    touch "$folder/complete"
}

# debian_unpack ROOT PACKAGE.deb…: as on a system whose /bin, /lib and /sbin are links into /usr.
debian_unpack() {
    local into=$1 name package
    shift
    for name in bin lib sbin; do
        mkdir -p "$into/usr/$name"
        [ -e "$into/$name" ] || ln -s "usr/$name" "$into/$name"
    done
    for package in "$@"; do dpkg-deb --fsys-tarfile "$package" | tar -x -C "$into" --keep-directory-symlink; done
}

# debian_database ROOT STATUS PREFIX PACKAGE.deb…: dpkg's database in ROOT, which has these packages in that
# status. Its paths begin with PREFIX.
debian_database() {
    local info=$1/var/lib/dpkg/info status=$2 prefix=$3 package name file
    local control=$1/var/lib/dpkg/control-files
    mkdir -p "$info" "$1"/var/lib/dpkg/{updates,triggers,parts,alternatives}
    echo arm64 >"$1/var/lib/dpkg/arch"
    echo 1 >"$info/format"
    shift 3
    for package in "$@"; do
        rm -rf "$control" && dpkg-deb -e "$package" "$control"
        name=$(sed -n 's/^Package: //p' "$control/control")
        sed "/^Package:/a Status: install ok $status" "$control/control"
        echo
        ! grep -q '^Multi-Arch: same' "$control/control" || name=$name:arm64
        rm "$control/control"
        for file in "$control"/*; do [ ! -e "$file" ] || mv "$file" "$info/$name.${file##*/}"; done
        dpkg-deb --fsys-tarfile "$package" | tar -t | sed -n "s,^\.\(/.*[^/]\)/*\$,$prefix\1,p" >"$info/$name.list"
    done >"$info/../status"
    rm -rf "$control"
}

# debian_modules FROM ROOT LIST: the modules that a list names, one a line, with what they need, from the
# unpacked kernel FROM into ROOT, stripped. out: the kernel's release.
debian_modules() {
    local release from=$1/lib/modules into=$2/lib/modules name file
    release=$(ls "$from")
    from=$from/$release into=$into/$release
    mkdir -p "$into"
    grep -v '^#' "$3" | while read -r name; do
        grep -E "/${name//[-_]/[-_]}\.ko:" "$from/modules.dep" ||
            grep -qE "/${name//[-_]/[-_]}\.ko" "$from/modules.builtin" || die "the kernel has no module $name"
    done | tr -d : | tr ' ' '\n' | sort -u | while read -r file; do
        [ -z "$file" ] || install -D -m 644 "$from/$file" "$into/$file"
    done
    cp "$from"/modules.builtin* "$from/modules.order" "$into/"
    aarch64-linux-gnu-strip --strip-debug $(find "$into" -name '*.ko')
    depmod -b "$2" "$release"
    find "$into" -name '*.symbols*' -delete -o -name '*.order' -delete
}

# debian_initramfs ROOT FILE
debian_initramfs() {
    (cd "$1" && find . | LC_ALL=C sort | cpio -o -H newc -R 0:0 --reproducible --quiet) | zstd -q "${3:--19}" -T0 >"$2"
}
