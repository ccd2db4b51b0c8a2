# Joins the page's modules and shaders to one file, program.html, and its styles and markup to another one, page.html:
# cmake -DPAGE=web/page -DSHADERS=shaders -DOUTPUT=folder -P bundle.cmake
#
# Modules become one script: each name is declared once in all of them, so that imports and exports can be left out. Comments are left
# out too.

# In an order in which classes come before their use while the script is read.
set(modules field/vector field/field_file field/payload field/exact_leaf field/leaves field/blend field/query
  drawing/camera drawing/bounds drawing/blocks drawing/shaders drawing/colors drawing/view drawing/renderer drawing/cell_lines
  drawing/painter drawing/pick drawing/viewer panels/dom questions/cell_numbers questions/jumps questions/line_probe questions/line_plot questions/measure
  panels/panels panels/questions panels/controls page)
set(shaders field.glsl full_screen.vert leaves_alone.glsl leaves_blended.glsl leaves_exact.glsl leaves_polynomial.glsl slice.frag
  surface.glsl surface.vert surface_hit.frag surface_march.frag)
set(page_shaders drawing/cells.frag drawing/cells.vert drawing/picture.frag drawing/section.frag)

# Reads a file without the lines that hold comments alone.
function(read_code file result)
  file(READ "${file}" text)
  string(REGEX REPLACE "\n *(//|/\\*\\*|\\*[ /])[^\n]*" "" text "\n${text}")
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
list(TRANSFORM shaders PREPEND "${SHADERS}/")
list(TRANSFORM page_shaders PREPEND "${PAGE}/")
foreach(shader IN LISTS shaders page_shaders)
  read_code("${shader}" text)
  string(REGEX REPLACE "^\n" "" text "${text}")  # a version has to stand first
  get_filename_component(name "${shader}" NAME)
  string(APPEND sources "<script type=\"x-shader\" data-name=\"${name}\">${text}</script>\n")
endforeach()

file(READ "${PAGE}/page.css" style)
file(READ "${PAGE}/page.html" page)
string(REPLACE "{{style}}" "${style}" page "${page}")
file(WRITE "${OUTPUT}/page.html" "${page}")
file(WRITE "${OUTPUT}/program.html" "${sources}<script type=\"module\">${script}</script>\n")
