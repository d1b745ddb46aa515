#include <algorithm>
#include <cmath>

#include "deck/card.h"

namespace {

const char* const drive_words = "RCE|VD|SPECTRAL|PRESSURE|NONE";
const char* const residual_words = "RCE|VD|SPECTRAL|PRESSURE|NONE|CRACK|GRANULAR";
// GRIFFITH: waves shorter than an element do not break the next element (A14)
const double average_default = 0.8;
const double release_default = 1.7;      // GRIFFITH: a running crack then dissipates Gc (A14)
const char* const criterion_words = "GRIFFITH|ELEMENT|COHESIVE";

// START=YES|NO
void read_start(Card& card, FractureDef& f)
{
  const HeadParam* p = card_param(card, "START");
  double number = 0.0;
  const std::string word = p && p->has_value ? text_upper(p->value.text) : "YES";
  if (word == "YES" || word == "NO") f.start = card_param_yes(card, "START", false, true);
  else if (parse_real(word, number))
    card_error(card, p->value, "START=stress is no longer available, because it broke all elements near the "
                               "first break; a strength requires CRITERION=COHESIVE: Gc, ft");
  else card_error(card, p->value, "START=" + p->value.text + " is neither YES nor NO");
}

void read_order(Card& card, FractureDef& f)
{
  f.order    = card_param_word(card, "ORDER", "STRONGEST|ALL", 0) == 1 ? ORDER_ALL : ORDER_STRONGEST;
  f.spacing  = card_param_real(card, "SPACING", -1.0, at_least(0.0));
  f.interval = card_param_real(card, "INTERVAL", 0.0, above(0.0));
  f.fallback = card_param_real(card, "FALLBACK", -1.0, at_least(0.0));
  read_start(card, f);
  if (f.order == ORDER_ALL && card_param(card, "SPACING"))
    card_error(card, card_param(card, "SPACING")->key, "SPACING has no meaning with ORDER=ALL; leave it out");
}

// ANGLE= of RESIDUAL=GRANULAR, in degrees
void read_angle(Card& card, FractureDef& f)
{
  const HeadParam* p  = card_param(card, "ANGLE");
  const double degree = card_param_real(card, "ANGLE", 0.0, between(0.0, 90.0));
  f.friction = std::tan(card_radians(degree));
  if (f.residual == SPLIT_GRANULAR && !p)
    card_error(card, card.head.at, "RESIDUAL=GRANULAR needs the angle of internal friction in degrees; write "
                                   "for example ANGLE=35");
  if (f.residual != SPLIT_GRANULAR && p)
    card_error(card, p->key, "ANGLE requires RESIDUAL=GRANULAR");
}

// reports parameters of other criteria and removed parameters
void check_words(Card& card, const FractureDef& f)
{
  if (const HeadParam* p = card_param(card, "SPEED LIMIT"))
    card_error(card, p->key, "SPEED LIMIT is no longer available, because it aligned cracks with the mesh; "
                             "leave it out");
  if (f.criterion != CRITERION_COHESIVE && card_param(card, "SOFTENING"))
    card_error(card, card_param(card, "SOFTENING")->key,
               "SOFTENING requires CRITERION=COHESIVE");
  if (f.track && (f.criterion != CRITERION_COHESIVE || card_param(card, "BODY")))
    card_error(card, card_param(card, "TRACK")->key,
               "TRACK requires CRITERION=COHESIVE and ELSET: it follows the tips of cracks in elements");
  if (f.criterion != CRITERION_GRIFFITH)
    for (const char* name : {"ESTIMATE", "EPSILON", "FALLBACK", "START"})
      if (card_param(card, name))
        card_error(card, card_param(card, name)->key,
                   std::string(name) + " requires CRITERION=GRIFFITH");
  if (f.criterion == CRITERION_COHESIVE)
    for (const char* name : {"SPLIT", "AVERAGE", "ORDER", "SPACING", "INTERVAL", "TOLERANCE"})
      if (card_param(card, name))
        card_error(card, card_param(card, name)->key,
                   std::string(name) + " has no meaning with CRITERION=COHESIVE; leave it out");
}

// BODY=: reports what bodies of material points do not have
void check_body(Card& card, const FractureDef& f)
{
  const HeadParam* p = card_param(card, "BODY");
  if (!p) return;
  if (card_param(card, "ELSET"))
    card_error(card, p->key, "ELSET and BODY exclude each other; write one definition for each");
  if (f.criterion != CRITERION_COHESIVE)
    card_error(card, p->key, "bodies of *MATERIAL POINTS crack with CRITERION=COHESIVE only; a crack with "
                             "another criterion starts in finite elements, which *CONVERSION makes points");
  for (const char* name : {"RESIDUAL", "ANGLE", "RELEASE"})
    if (card_param(card, name))
      card_error(card, card_param(card, name)->key,
                 std::string(name) + " has no meaning with BODY: an open crack carries pressure alone; leave "
                                     "it out");
}

}  // namespace

// ---------------------------------------------------------------------------
// *EIGENFRACTURE, ELSET=|BODY=[, CRITERION=GRIFFITH|ELEMENT|COHESIVE][, ESTIMATE=][, EPSILON=][, SPLIT=]
// [, RESIDUAL=][, STIFFNESS=] ... : Gc[, ft]
// ---------------------------------------------------------------------------
void kw_eigenfracture(Card& card, Model& model)
{
  FractureDef f;
  f.deck_line = card_deck_line(card);
  const int criterion = card_param_word(card, "CRITERION", criterion_words, 0),
            estimate = card_param_word(card, "ESTIMATE", "AUTO|FORCE|BALL", 0);
  const int drive = card_param_word(card, "SPLIT", drive_words, 0),
            residual = card_param_word(card, "RESIDUAL", residual_words, SPLIT_CRACK);
  f.criterion = static_cast<Criterion>(criterion < 0 ? 0 : criterion);
  f.estimate  = static_cast<Estimate>(estimate < 0 ? 0 : estimate);
  f.drive     = static_cast<Split>(drive < 0 ? 0 : drive);
  f.residual  = static_cast<Split>(residual < 0 ? 0 : residual);
  read_angle(card, f);
  f.release = card_param_real(card, "RELEASE", f.criterion == CRITERION_GRIFFITH ? release_default : 0.0,
                              at_least(0.0));
  f.average = card_param_real(card, "AVERAGE", f.criterion == CRITERION_GRIFFITH ? average_default : 0.0,
                              at_least(0.0));
  f.epsilon   = card_param_real(card, "EPSILON", 0.0, at_least(1.0));
  f.stiffness = card_param_real(card, "STIFFNESS", f.stiffness, from_to(0.0, 1.0));
  f.weibull   = card_param_real(card, "WEIBULL", 0.0, at_least(0.1));
  f.tolerance = card_param_real(card, "TOLERANCE", f.tolerance, from_to(0.0, 1.0));
  f.softening = static_cast<Softening>(
      std::max(0, card_param_word(card, "SOFTENING", "LINEAR|BILINEAR|EXPONENTIAL", SOFTENING_LINEAR)));
  f.track     = card_param_yes(card, "TRACK", false,
                               f.criterion == CRITERION_COHESIVE && !card_param(card, "BODY"));
  f.seed      = card_param_int(card, "SEED", 1, 0, 2147483647);
  read_order(card, f);
  check_words(card, f);
  if (card_param(card, "SEED") && !card_param(card, "WEIBULL"))
    card_error(card, card_param(card, "SEED")->key, "SEED requires WEIBULL=modulus");
  check_body(card, f);
  const Field elset = card_param_field(card, "ELSET"), body = card_param_field(card, "BODY");
  if (elset.empty() && body.empty())
    card_error(card, card.head.at, "*EIGENFRACTURE needs ELSET=name of the elements that may break, or "
                                   "BODY=name of a body of *MATERIAL POINTS");
  if (!card_line(card)) {
    card_error(card, card.head.at,
               f.criterion == CRITERION_COHESIVE
                   ? "a data line must follow: Gc, ft, the toughness in force/length and the strength in "
                     "force/length^2"
                   : "a data line must follow: Gc, the toughness in force/length");
    return;
  }
  f.gc = card_real(card, "Gc", above(0.0));
  if (f.criterion == CRITERION_COHESIVE) f.ft = card_real(card, "ft", above(0.0));
  card_end(card);
  const std::size_t i = model.fracture.size();
  if (card_param(card, "TRACK")) card.deck->tracked.insert(static_cast<int>(i));
  model.fracture.push_back(f);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    if (!elset.empty()) m.fracture[i].elset = target_elset(d, m, elset);
    else if (!body.empty()) m.fracture[i].body = target_body(d, m, body);
  });
}
