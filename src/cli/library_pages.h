#pragma once

namespace warpath {

/// Gives back what the dynamic linker has read of shared libraries: what is used comes again from the system's cache of
/// files. OpenImageIO brings some 240 libraries for formats that a scene may not have, 85 MB of which would stay.
void give_back_library_pages();

}  // namespace warpath
