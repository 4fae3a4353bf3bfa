#include "cli/library_pages.h"

#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>

namespace warpath {

void give_back_library_pages() {
  dl_iterate_phdr(
      [](dl_phdr_info* library, std::size_t, void*) {
        const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
        for (int i = 0; i < library->dlpi_phnum; ++i) {
          const auto& segment = library->dlpi_phdr[i];
          // What can be written to is the process's own.
          if (segment.p_type != PT_LOAD || (segment.p_flags & PF_W)) continue;
          const std::uintptr_t begin = (library->dlpi_addr + segment.p_vaddr) / page * page;
          const std::uintptr_t end = (library->dlpi_addr + segment.p_vaddr + segment.p_filesz) / page * page;
          if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);
        }
        return 0;
      },
      nullptr);
}

}  // namespace warpath
