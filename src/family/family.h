#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/tensor_file.h"
#include "path/layout.h"
#include "train/resample.h"
#include "train/settings.h"
#include "train/training_data.h"
#include "train/vertex_learner.h"
#include "warp/proposal.h"
#include "warp/vertex_proposal.h"

namespace warpath {

// A family of warps: what it is called, what it draws, and how it is trained and loaded. A file of this folder says it
// of each, and one line of registry.cpp makes it known; whoever needs a family by its name looks it up there.

/// Fits a proposal to candidates that are all in memory, each with its target as a weight.
using FitToCandidates =
    std::function<std::shared_ptr<const Proposal>(Examples, const TrainSettings&, const Proposal* init)>;

/// Fits a proposal to examples that are resampled from candidates, which may come in chunks.
struct FitToExamples {
  std::function<Fit(const ResampledExamples&, const TrainSettings&, const Proposal* init)> fit;
  /// How many examples are drawn from so many candidates; by default as many as the settings say.
  std::function<std::uint64_t(const TrainSettings&, std::uint64_t candidates)> count{};
  /// Brighter candidates count as so much, in units of E[g^2] / E[g], the mean over examples; 0: as bright as they are.
  double most_target = 0;
};

/// A density over chosen numbers of the whole path, fitted to candidates before the render.
struct JointFamily {
  /// Loads what save() put under a prefix. Throws FileError.
  std::shared_ptr<const Proposal> (*load)(const TensorFile& file, const std::string& prefix);
  /// None: there is nothing to learn.
  std::variant<std::monostate, FitToCandidates, FitToExamples> fit{};
  int most_dims = 0;

  /// What an Integrator asks for: a warp fitted to the points of its iterations.
  struct Adapted {
    std::shared_ptr<const Warp> warp;
    std::uint64_t trained = 0;  ///< examples that a flow was trained on, each as often as it was used
  };
  /// tempered: the weights are those of a target between the density that drew the points and the integrand. before:
  /// what was learned so far, or null. Empty: an Integrator has other ways, see integrate/learner.
  std::function<Adapted(Examples, bool tempered, std::uint64_t seed, const Warp* before)> adapt{};
  bool is_flow = false;  ///< may stand in front of a grid, and is trained no more often than it pays

  bool learns() const { return fit.index() != 0; }
};

/// What a warp of vertices must know of the scene that it is to learn.
struct LearnedScene {
  int film_width = 0, film_height = 0;  ///< pixels of the whole film
  int emitters = 1;                     ///< from how many the number `light` chooses
};

/// A density at vertices, given what the path knows there; learned while it renders.
struct VertexFamily {
  std::shared_ptr<const VertexProposal> (*load)(const TensorFile& file, const std::string& prefix);
  /// numbers: those that are warped, see check_decisions; empty for those of every vertex. init: a proposal of this
  /// family to go on from, or null. Throws ConfigError.
  std::unique_ptr<VertexLearner> (*make_learner)(const TrainSettings& settings, const LearnedScene& scene,
                                                 const Layout& numbers, const VertexProposal* init);
  bool every_vertex = false;  ///< may warp the numbers of every vertex; else it needs to be told which
  bool goes_on = false;       ///< can start from a saved one
};

/// Puts other proposals together. No method of its own.
struct Container {
  std::shared_ptr<const Proposal> (*load)(const TensorFile& file, const std::string& prefix);
};

struct Family {
  std::string name;
  std::string help;  ///< what it is, in a few words
  std::variant<JointFamily, VertexFamily, Container> kind;

  const JointFamily* joint() const { return std::get_if<JointFamily>(&kind); }
  const VertexFamily* at_vertices() const { return std::get_if<VertexFamily>(&kind); }
  bool is_container() const { return std::holds_alternative<Container>(kind); }
  bool learns() const { return at_vertices() || (joint() && joint()->learns()); }
};

/// All of them, in the order in which help lists them.
const std::deque<Family>& families();
/// Null if there is none of that name.
const Family* find_family(std::string_view name);
/// Makes one more family known, before anything else asks for it.
void register_family(Family family);
/// The names of those that are chosen by `among`.
std::vector<std::string> family_names(const std::function<bool(const Family&)>& among);

/// The proposal that Proposal::save put under `prefix`, of whatever family. Throws FileError if it is unknown or
/// broken.
std::shared_ptr<const Proposal> load_proposal(const TensorFile& file, const std::string& prefix);

}  // namespace warpath
