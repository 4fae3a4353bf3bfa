#include "render/method.h"

#include <array>
#include <optional>

#include "core/rng.h"
#include "core/streams.h"
#include "integrand/path_integrand.h"
#include "train/candidates.h"
#include "train/conditional_kdtree_learner.h"
#include "train/conditional_spline_learner.h"
#include "train/field_learner.h"
#include "train/train.h"
#include "warp/field.h"
#include "warp/warp_file.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::array<std::string_view, 8> kFamilies{"none",    "uniform", "grid",  "kdtree",
                                                    "realnvp", "spline",  "field", "auto"};
constexpr std::string_view kDefaultDimensions = "film+bounce1";

/// More candidates than this, 256 MB of them, are gathered and resampled in chunks of so many, where the family allows.
constexpr std::uint64_t kChunk = std::uint64_t{1} << 26;

/// What a path costs with a warp, over what one costs without, by count of operations. The field: looking every vertex
/// up, two densities, what half of the paths teach, and longer paths with more light to look for, against two rays, a
/// BSDF and a light. Of the first hit alone: two look-ups in three trees, or a network, and what paths teach.
constexpr double kFieldCost = 1.85, kFirstHitTreeCost = 1.25, kFirstHitSplineCost = 1.5;
/// Paths that cost as much as growing the trees, and training the spline, after one of the first passes.
constexpr double kFirstHitTreeFit = 4e4, kFirstHitSplineFit = 6e4;

}  // namespace

Method parse_method(const std::string& text) {
  Method method;
  method.name = text;
  const std::size_t colon = text.find(':');
  method.family = text.substr(0, colon);
  if (std::find(kFamilies.begin(), kFamilies.end(), method.family) == kFamilies.end()) {
    if (!std::filesystem::exists(text))
      throw ConfigError(fmt::format("unknown warp \"{}\", neither a family nor a file;{}", text,
                                    suggestion(method.family, kFamilies)));
    method.file = text;
    const WarpFile file = load_warp(text);
    method.family = family_of(file);
    method.layout = file.layout;
    return method;
  }
  if (method.family == "none") {
    if (colon != std::string::npos)
      throw ConfigError(fmt::format("\"{}\": `none` has no dimensions; uniform:{} draws those at random", text,
                                    text.substr(colon + 1)));
    return method;
  }
  if (method.family == "field") {
    if (colon != std::string::npos) method.layout = Layout::parse(std::string_view(text).substr(colon + 1));
    try {
      check_decisions(method.layout);
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("\"{}\": {}", text, error.what()));
    }
    return method;
  }
  if (method.family == "auto") {
    if (colon != std::string::npos) throw ConfigError(fmt::format("\"{}\": auto has no dimensions to choose", text));
    return method;
  }
  method.layout =
      Layout::parse(colon == std::string::npos ? kDefaultDimensions : std::string_view(text).substr(colon + 1));
  return method;
}

std::optional<Objective> parse_objective(const std::string& name) {
  constexpr std::array<std::string_view, 3> kNames{"mse", "relmse", "even"};
  if (name == "mse") return Objective::mse;
  if (name == "relmse") return Objective::relmse;
  if (name == "even") return std::nullopt;
  throw ConfigError(fmt::format("unknown objective \"{}\";{}", name, suggestion(name, kNames)));
}

Sampler parse_sampler(const std::string& name, const Layout& layout) {
  constexpr std::array<std::string_view, 3> kNames{"independent", "stratified", "sobol"};
  for (const Sampler sampler : {Sampler::independent, Sampler::stratified, Sampler::sobol}) {
    if (name != sampler_name(sampler)) continue;
    if (sampler != Sampler::independent && layout.contains({GroupKind::film}))
      throw ConfigError(
          fmt::format("sampler {}: {} warps the film, and its samples are independent", name, layout.name()));
    return sampler;
  }
  throw ConfigError(fmt::format("unknown sampler \"{}\";{}", name, suggestion(name, kNames)));
}

std::shared_ptr<const Candidates> MethodTrainer::gather(const Layout& layout, std::uint64_t first, std::uint64_t end,
                                                        const std::function<void(std::uint64_t)>& progress) const {
  const std::uint64_t seed = mix64(m_settings.seed ^ kCandidateStream);
  const PathIntegrand integrand(m_tracer, layout, seed);
  return std::make_shared<Candidates>(
      gather_candidates(integrand, layout, seed, end - first, progress, m_use_samples, first));
}

std::shared_ptr<const Candidates> MethodTrainer::candidates(const Layout& layout, std::uint64_t count) {
  auto& known = m_candidates[layout.name()];
  if (known && known->size() == count) return known;
  const Progress progress = m_stages(fmt::format("candidates for {}", layout.name()));
  known = gather(layout, 0, count,
                 [&](std::uint64_t done) { progress(static_cast<double>(done) / static_cast<double>(count)); });
  return known;
}

Fit MethodTrainer::train_in_chunks(const Layout& layout, const TrainSettings& settings, const Proposal* init,
                                   PreparedMethod& prepared) {
  const std::uint64_t count = prepared.candidate_count;
  Progress progress = m_stages(fmt::format("candidates for {}", layout.name()));
  return warpath::train_in_chunks(
      layout, count,
      [&](const auto& take) {
        for (std::uint64_t first = 0; first < count; first += kChunk) {
          const auto chunk = gather(layout, first, std::min(count, first + kChunk), [&](std::uint64_t done) {
            progress(static_cast<double>(first + done) / static_cast<double>(count));
          });
          prepared.candidate_seconds += chunk->seconds;
          prepared.candidate_cpu_seconds += chunk->cpu_seconds;
          if (first == 0) prepared.candidates = chunk;
          take(*chunk);
        }
        progress = {};
        progress = m_stages("training");
      },
      settings, init);
}

void PreparedMethod::add_candidates(ImageEstimator& estimator) const {
  if (!candidates || candidates->contribution.empty()) return;
  const std::uint32_t d = Group{GroupKind::film}.first_dimension();
  for (std::uint64_t id = 0; id < candidates->size(); ++id) {
    const std::uint64_t key = sample_key(candidates->seed, kFirstCandidate + id);
    const float* f = candidates->contribution.data() + 3 * id;
    estimator.add_uniform_sample(sample_float(key, d), sample_float(key, d + 1), Color(f[0], f[1], f[2]));
  }
}

std::unique_ptr<VertexLearner> MethodTrainer::conditional_trainer(const Method& method) const {
  if (method.family == "spline") {
    ConditionalSplineSettings settings = m_settings.conditional_spline;
    settings.numbers = method.layout;
    return std::make_unique<ConditionalSplineLearner>(settings, m_settings.uniform, m_settings.seed);
  }
  if (method.family == "kdtree") {
    ConditionalKdTreeSettings settings = m_settings.conditional_kdtree;
    settings.numbers = method.layout;
    const FilmSettings& film = m_tracer->scene().film;
    return std::make_unique<ConditionalKdTreeLearner>(settings, film.width, film.height, m_settings.uniform);
  }
  return nullptr;
}

std::vector<Contender> MethodTrainer::contenders(std::unique_ptr<VertexLearner> field,
                                                 std::shared_ptr<const VertexProposal> warp) const {
  std::vector<Contender> all;
  all.push_back({"field", std::move(field), kFieldCost, 0, std::move(warp)});
  const auto add = [&](const char* name, double path_cost, double fit_cost) {
    all.push_back({name, conditional_trainer(parse_method(name)), path_cost, fit_cost});
  };
  add("kdtree:bounce1.light+bounce1.light_uv+bounce1.lobe+bounce1", kFirstHitTreeCost, kFirstHitTreeFit);
  add("spline:bounce1.lobe+bounce1", kFirstHitSplineCost, kFirstHitSplineFit);
  return all;
}

PreparedMethod MethodTrainer::prepare(const Method& method) {
  PreparedMethod prepared;
  if (method.family == "none") return prepared;
  if (!method.layout.contains({GroupKind::film})) prepared.guide.objective = m_objective;
  if (!method.file.empty()) {
    const WarpFile file = load_warp(method.file);
    prepared.proposal = file.proposal;
    prepared.guide.warp = file.vertex_proposal;
    return prepared;
  }
  if (are_decisions(method.layout))
    if (auto trainer = conditional_trainer(method)) {
      if (!m_init.empty())
        throw ConfigError(
            fmt::format("--init {}: {} starts anew; field can start from a field", m_init.string(), method.name));
      prepared.guide.trainer = std::move(trainer);
      return prepared;
    }
  if (method.family == "field" || method.family == "auto") {
    FieldSettings settings = m_settings.field;
    settings.numbers = method.layout;
    auto trainer = std::make_unique<FieldLearner>(settings, m_tracer->emitters());
    if (!m_init.empty()) {
      const auto field = std::dynamic_pointer_cast<const Field>(load_warp(m_init).vertex_proposal);
      if (!field)
        throw ConfigError(fmt::format("--init {}: not a field, which {} starts from", m_init.string(), method.family));
      trainer->start_from(*field);
      prepared.guide.warp = field;
    }
    if (method.family == "auto")
      prepared.guide.contenders = contenders(std::move(trainer), std::move(prepared.guide.warp));
    else
      prepared.guide.trainer = std::move(trainer);
    return prepared;
  }
  TrainSettings settings = m_settings;
  settings.family = method.family;
  std::shared_ptr<const Proposal> init;
  if (!m_init.empty()) init = load_warp(m_init).proposal;
  Fit fit;
  if (method.family != "uniform")
    prepared.candidate_count = static_cast<std::uint64_t>(static_cast<double>(settings.examples) * settings.alpha);
  if (prepared.candidate_count > kChunk && trains_in_chunks(method.family) && !m_use_samples) {
    fit = train_in_chunks(method.layout, settings, init.get(), prepared);
  } else {
    Candidates none;
    none.layout = method.layout;
    if (prepared.candidate_count > 0) {
      prepared.candidates = candidates(method.layout, prepared.candidate_count);
      prepared.candidate_seconds = prepared.candidates->seconds;
      prepared.candidate_cpu_seconds = prepared.candidates->cpu_seconds;
    }
    const Progress progress = prepared.candidates ? m_stages(fmt::format("training {}", method.name)) : Progress();
    fit = train(prepared.candidates ? *prepared.candidates : none, settings, init.get());
  }
  prepared.proposal = std::move(fit.proposal);
  prepared.log = std::move(fit.log);
  return prepared;
}

}  // namespace warpath
