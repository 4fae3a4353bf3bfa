#pragma once
#include <string_view>

namespace warpath::web {

// The files of web/, put into the binary by embed.cmake.
extern const std::string_view kReportHtml;  ///< the page, with {{title}}, {{style}}, {{data}} and {{script}} to fill in
extern const std::string_view kStyle;
extern const std::string_view kScript;  ///< the scripts, one after the other

}  // namespace warpath::web
