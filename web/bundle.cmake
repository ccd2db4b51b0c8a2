# Joins the page's modules, styles and shaders to one HTML file, in which {{title}}, {{date}} and {{field}} stand for what the program
# fills in: cmake -DPAGE=web/page -DSHADERS=shaders -DOUTPUT=page.html -P bundle.cmake
#
# Modules become one script: each name is declared once in all of them, so that imports and exports can be left out. Comments are left
# out too.

# In an order in which classes come before their use while the script is read.
set(modules vector field_file exact_leaf leaves query bounds blocks camera shaders colors view renderer painter page)
set(shaders field.glsl full_screen.vert leaves_alone.glsl leaves_exact.glsl leaves_polynomial.glsl slice.frag
  surface.glsl surface.vert surface_hit.frag surface_march.frag)

# Reads a file without the lines that hold comments alone.
function(read_code file result)
  file(READ "${file}" text)
  string(REGEX REPLACE "\n *(//|/\\*\\*|\\*)[^\n]*" "" text "\n${text}")
  string(REGEX REPLACE "\n\n+" "\n" text "${text}")
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

set(script "")
foreach(module IN LISTS modules)
  read_code("${PAGE}/${module}.js" text)
  string(REGEX REPLACE "\nimport [^\n]*" "" text "${text}")
  string(REGEX REPLACE "\nexport " "\n" text "${text}")
  string(APPEND script "${text}")
endforeach()

set(sources "")
foreach(shader IN LISTS shaders)
  read_code("${SHADERS}/${shader}" text)
  string(APPEND sources "<script type=\"x-shader\" data-name=\"${shader}\">${text}</script>\n")
endforeach()
read_code("${PAGE}/picture.frag" text)
string(REGEX REPLACE "^\n" "" text "${text}")  # its version stands first
string(APPEND sources "<script type=\"x-shader\" data-name=\"picture.frag\">${text}</script>\n")

file(READ "${PAGE}/page.css" style)
file(READ "${PAGE}/page.html" page)
string(REPLACE "{{style}}" "${style}" page "${page}")
string(REPLACE "{{shaders}}" "${sources}" page "${page}")
string(REPLACE "{{script}}" "${script}" page "${page}")
file(WRITE "${OUTPUT}" "${page}")
