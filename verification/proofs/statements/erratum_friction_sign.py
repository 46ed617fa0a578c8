"""Erratum: the sliding branch of (6) has no sign, and with a signed v_t it drives the motion."""

from verification.proofs.algebra import scalar
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative, equation
from verification.proofs.rewriting import positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Term


def statement() -> Statement:
    mu, normal, sign, speed, friction = (scalar(name) for name in ("μ", "N", "σ", "vₜ", "f"))
    law = equation("friction with its sign", friction, -mu * normal * sign)
    rough, pressed = NonNegative("μ ≥ 0", mu), NonNegative("N ≥ 0", normal)
    along = NonNegative("σ = ±1 is the sign of vₜ: σ vₜ ≥ 0", sign * speed)
    passive = positivity(
        "friction takes energy: −f vₜ ≥ 0", -friction * speed, (Term(1, (rough, pressed, along)),), (law,)
    )
    case = instance({"μ": "1/2", "N": 1, "σ": -1, "vₜ": -1})
    return Statement(
        name="erratum_friction_sign",
        title="Erratum: the sign missing in the friction law",
        source="paper (6); the absolute value in its condition shows that vₜ may be negative",
        statement=(
            r"(6) sets $F_f = -\mu F_n$ for $|v_t| \geq v_{threshold}$. For $v_t < 0$ this pushes along the "
            r"motion. With $\sigma$ the sign of $v_t$, $f = -\mu N \sigma$ takes the power $\mu N |v_t| "
            r"\geq 0$ out."
        ),
        given=(rough, pressed, along),
        definitions=(law,),
        steps=(passive,),
        concludes=(passive.claim.name,),
        witness=case,
        needed=(
            Without(rough.name, case.with_values(μ=-1)),
            Without(
                pressed.name,
                case.with_values(N=-1),
                "(5) as printed may pull: then friction drives the motion",
            ),
            Without(along.name, case.with_values(σ=1), "the printed law"),
        ),
        twins=(
            Twin(
                "(6) as printed takes energy at every velocity",
                NonNegative("μ N vₜ ≥ 0", mu * normal * speed),
                case,
                "a body sliding at −1 is pushed by −1/2",
            ),
        ),
        remarks=(
            "If t is turned to point along the sliding velocity in each step, vₜ is never negative and (6) "
            "is right; the paper only says that t is orthogonal to the normal.",
        ),
    )
