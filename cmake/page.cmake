# Makes a C++ source of the files of a folder, for host-tools/view/page.h:
#   cmake -DFOLDER=host-tools/view/page -DSOURCE=page_files.cpp -P page.cmake
file(GLOB_RECURSE names RELATIVE ${FOLDER} ${FOLDER}/*)
list(SORT names) # bytewise, as find_page() searches
set(types html text/html css text/css js text/javascript txt text/plain LICENSE text/plain md text/plain json application/json svg image/svg+xml
    png image/png ico image/x-icon woff2 font/woff2 webmanifest application/manifest+json)
set(arrays)
set(rows)
set(count 0)
foreach(name ${names})
    string(REGEX REPLACE ".*[./]" "" suffix "${name}")
    list(FIND types "${suffix}" at)
    if(at EQUAL -1)
        message(FATAL_ERROR "${FOLDER}/${name}: cmake/page.cmake knows no content type of *.${suffix}")
    endif()
    math(EXPR at "${at} + 1")
    list(GET types ${at} type)
    if(type MATCHES "^text/")
        set(type "${type}; charset=utf-8")
    endif()
    file(SHA256 ${FOLDER}/${name} hash)
    string(SUBSTRING ${hash} 0 16 hash)
    file(READ ${FOLDER}/${name} hex HEX)
    string(REGEX REPLACE "(..)" "'\\\\x\\1'," bytes "${hex}")
    string(APPEND arrays "const char file_${count}[] = {${bytes}'\\0'};\n")
    string(APPEND rows "    {\"${name}\", \"${type}\", \"\\\"${hash}\\\"\", {file_${count}, sizeof file_${count} - 1}},\n")
    math(EXPR count "${count} + 1")
endforeach()
file(WRITE ${SOURCE} "// Made by cmake/page.cmake.
#include \"host-tools/view/page.h\"
namespace compbox::view {
namespace {
${arrays}}
const page_file page_files[] = {
${rows}};
const unsigned page_files_count = ${count};
}
")
