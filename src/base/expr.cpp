#include "base/expr.h"

#include <muParser.h>

#include <cmath>

struct ExprCode {
  mu::Parser parser;
  double x = 0.0, y = 0.0, z = 0.0, t = 0.0;
};

namespace {

double step_function(double s) { return s >= 0.0 ? 1.0 : 0.0; }

// parser with the functions and constants that every expression knows
void prepare(mu::Parser& parser, const ParamMap& param)
{
  parser.DefineConst("pi", std::acos(-1.0));
  parser.DefineFun("heaviside", step_function);
  for (const auto& p : param) parser.DefineConst(p.first, p.second);
}

bool report(const mu::Parser::exception_type& e, std::string& error, int& position)
{
  error    = e.GetMsg();
  position = static_cast<int>(e.GetPos());
  return false;
}

}  // namespace

Expr expr_number(double value)
{
  Expr e;
  e.value = value;
  return e;
}

bool expr_compile(const std::string& text, const ParamMap& param, Expr& out,
                  std::string& error, int& position)
{
  auto code = std::make_shared<ExprCode>();
  try {
    prepare(code->parser, param);
    code->parser.DefineVar("x", &code->x);
    code->parser.DefineVar("y", &code->y);
    code->parser.DefineVar("z", &code->z);
    code->parser.DefineVar("t", &code->t);
    code->parser.SetExpr(text);
    code->parser.Eval();
  } catch (const mu::Parser::exception_type& e) {
    return report(e, error, position);
  }
  out.text = text;
  out.code = code;
  return true;
}

bool expr_scalar(const std::string& text, const ParamMap& param, double& value,
                 std::string& error, int& position)
{
  mu::Parser parser;
  try {
    prepare(parser, param);
    parser.SetExpr(text);
    value = parser.Eval();
  } catch (const mu::Parser::exception_type& e) {
    return report(e, error, position);
  }
  return true;
}

double expr_eval(const Expr& e, const double x[3], double t)
{
  if (!e.code) return e.value;
  e.code->x = x[0];
  e.code->y = x[1];
  e.code->z = x[2];
  e.code->t = t;
  return e.code->parser.Eval();
}
