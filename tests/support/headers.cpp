// This file is otherwise empty: the CMake target of the precompiled headers needs a source file.
