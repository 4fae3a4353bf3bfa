#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "report/image.h"
#include "report/results.h"

namespace warpath {

/// A density over two dimensions of the unit cube, in equal cells: `values[j * width + i]` is its mean over cell (i,
/// j), where i counts along the first dimension and j along the second, both from 0 upwards. 1 everywhere is the
/// uniform density.
struct DensityGrid {
  int width = 0;
  int height = 0;
  std::vector<float> values;
};

/// Where a method puts its samples, beside where it should: two dimensions, the others averaged out or held where
/// `slice` says.
struct DensityPicture {
  std::string method;       ///< as in MethodRun
  std::string x_dimension;  ///< `film.x`; dimensions of the film are drawn as the image lies, with y downwards
  std::string y_dimension;  ///< `bounce1.dir.v`
  std::string slice;        ///< `film = (0.5, 0.5)`; empty: the marginal over all other dimensions
  DensityGrid learned;      ///< density of the warp's samples
  DensityGrid candidates;   ///< histogram of the candidates, weighted by the target g; same size as `learned`
};

/// A method's image, of its first run.
struct ReportImage {
  std::string method;
  ImageRgb image;
};

/// What the report shows. All may be missing except one method: without a reference differences are to the baseline's
/// image and no errors are shown; without training curves or densities their sections are left out.
struct ReportData {
  Comparison comparison;
  std::optional<ImageRgb> reference;
  std::vector<ReportImage> images;
  std::vector<DensityPicture> densities;
};

/// One HTML page that needs nothing else, works from file:// without a network, and lets nothing that it shows act as
/// markup. Images are in it as half floats, so that exposure in the page is that of the render; values beyond 65504 are
/// clipped to that.
std::string report_html(const ReportData& data);

/// Writes `folder/index.html` and `folder/results.json`, each whole or not at all. Throws FileError.
void write_report(const std::filesystem::path& folder, const ReportData& data);

}  // namespace warpath
