(* What `wide_gain` accepts (iapb/contact/kernels/passive.py), the evaluation for numbers of any size.

   It adds products of the halves of w - v and w + v with entries of M, each as x m y 2^k of mantissas in [1/2, 1) and
   k <= 0; terms with k < -800 are omitted.
   [wide_never_gains_in_binary64]: its bound is finite for every M, v and w, and if
   it is at most 0, then w'Mw <= v'Mv over the real numbers. [halves_finite]: no sum of `_half` overflows.

   Assumed of the C library: frexp and ldexp are exact. n = 8 d^2 <= 2^33 terms. *)

From Coq Require Import ZArith Reals List Lia Lra Psatz Bool.
From Flocq Require Import Core Mult_error BinarySingleNaN.
Require Import Passive.
Require Import Accepted.
Import ListNotations.
Open Scope R_scope.

(* A product x m y 2^k of mantissas. *)
Record scaled := Scaled { wx : R; wm : R; wy : R; wk : Z }.
Definition mantissa x := number x /\ / 2 <= Rabs x <= 1.
Definition well t := mantissa (wx t) /\ mantissa (wm t) /\ mantissa (wy t) /\ (wk t <= 0)%Z.
Definition value t := wx t * wm t * wy t * bpow radix2 (wk t).
Definition term_of t :=
  let pe := two_product (wx t) (wm t) in let qf := two_product (fst pe) (wy t) in
  let unit := bpow radix2 (wk t) in let big := multiply (fst qf) unit in
  Term big 0 (multiply (add (snd qf) (multiply (snd pe) (wy t))) unit) (Rabs big).

Lemma small_eta : eta <= u * u * u * / 1024.
Proof.
  rewrite u_value. apply Rle_trans with (bpow radix2 (-200)); [apply bpow_le; lia |]. simpl. lra.
Qed.

Lemma term_fits t : well t -> (-800 <= wk t)%Z ->
  fits 0 (4 * u) eta (term_of t) /\ number (p (term_of t)) /\
  Rabs (value t - (p (term_of t) + e (term_of t) + c (term_of t))) <= 9 * u * u * weight (term_of t) + / 2 * eta.
Proof.
  intros ((Fx & Bx) & (Fm & Bm) & (Fy & By) & Hk) Hl.
  pose proof u_positive as Hu. pose proof eta_positive as He. pose proof small_eta as Hs. pose proof u_value as Uv.
  unfold term_of; cbv zeta. set (pe := two_product (wx t) (wm t)). set (p1 := fst pe). set (e1 := snd pe).
  set (qf := two_product p1 (wy t)). set (q := fst qf). set (f1 := snd qf). set (U := bpow radix2 (wk t)).
  cbn [p e c weight].
  assert (Small : bpow radix2 (-969) <= / 16) by (apply Rle_trans with (bpow radix2 (-4)); [apply bpow_le;
    lia | simpl; lra]).
  assert (U0 : 0 < U) by apply bpow_gt_0.
  assert (U1 : U <= 1) by (change 1 with (bpow radix2 0); apply bpow_le; exact Hk).
  set (Q1 := Rabs (wx t * wm t)). set (Y := Rabs (wy t)) in *.
  assert (HQ1 : / 4 <= Q1 <= 1).
  { unfold Q1. rewrite Rabs_mult. split.
    - replace (/ 4) with (/ 2 * / 2) by lra. apply Rmult_le_compat; lra.
    - rewrite <- (Rmult_1_l 1). apply Rmult_le_compat; try apply Rabs_pos; lra. }
  set (Q := Q1 * Y).
  assert (HQ : / 8 <= Q <= 1).
  { unfold Q. split.
    - replace (/ 8) with (/ 4 * / 2) by lra. apply Rmult_le_compat; lra.
    - rewrite <- (Rmult_1_l 1). apply Rmult_le_compat; lra. }
  assert (uQ : / 8 * u <= u * Q) by (rewrite (Rmult_comm u); apply Rmult_le_compat_r; lra).
  assert (uuQ : / 8 * (u * u) <= u * u * Q) by (rewrite (Rmult_comm (u * u)); apply Rmult_le_compat_r;
    [apply Rmult_le_pos; lra | lra]).
  assert (uu : u * u <= u * / 1048576) by (apply Rmult_le_compat_l; [lra | rewrite Uv; lra]).
  assert (uu0 : 0 <= u * u) by (apply Rmult_le_pos; lra).
  assert (uuu : u * u * u <= u * u * / 1048576) by (apply Rmult_le_compat_l; [exact uu0 | rewrite Uv; lra]).
  assert (eQ : eta <= u * u * Q * / 64) by lra.
  assert (E1 : p1 + e1 = wx t * wm t).
  { apply two_product_exact; try assumption. right. fold Q1. lra. }
  assert (Fp : number p1) by apply number_round. assert (Fe : number e1) by apply number_round.
  assert (Be : Rabs (e1 * wy t) <= u * Q + eta).
  { replace e1 with (wx t * wm t - p1) by lra. rewrite Rabs_mult. fold Y.
    pose proof (multiply_near (wx t) (wm t)) as N. fold Q1 in N. change (multiply (wx t) (wm t)) with p1 in N.
    apply Rle_trans with ((u * Q1 + / 2 * eta) * Y); [apply Rmult_le_compat_r; [apply Rabs_pos | exact N] |].
    assert (eta * Y <= eta * 1) by (apply Rmult_le_compat_l; lra). unfold Q. lra. }
  assert (Bxy : Rabs (wx t * wm t * wy t) = Q) by (rewrite Rabs_mult; reflexivity).
  assert (Py : p1 * wy t = wx t * wm t * wy t - e1 * wy t) by (rewrite <- E1; ring).
  assert (P_high : Rabs (p1 * wy t) <= Q + u * Q + eta).
  { rewrite Py. apply Rle_trans with (1 := Rabs_triang _ _). rewrite Rabs_Ropp. lra. }
  assert (P_low : Q - u * Q - eta <= Rabs (p1 * wy t)).
  { rewrite Py. pose proof (Rabs_triang_inv (wx t * wm t * wy t) (e1 * wy t)). lra. }
  assert (E2 : q + f1 = p1 * wy t).
  { apply two_product_exact; try assumption. right. assert (u * Q <= / 1048576 * 1) by (apply Rmult_le_compat;
      try lra; rewrite Uv; lra).
    assert (u * u * Q <= / 1048576) by (rewrite Rmult_assoc; apply Rle_trans with (u * / 1048576);
      [apply Rmult_le_compat_l; lra | rewrite Uv; lra]). lra. }
  assert (Fq : number q) by apply number_round. assert (Ff : number f1) by apply number_round.
  pose proof (multiply_near p1 (wy t)) as N2. change (multiply p1 (wy t)) with q in N2.
  assert (uP : u * Rabs (p1 * wy t) <= u * (Q + u * Q + eta)) by (apply Rmult_le_compat_l; lra).
  assert (ue : u * eta <= / 4 * eta) by (apply Rmult_le_compat_r; [lra | rewrite Uv; lra]).
  assert (Bf : Rabs f1 <= u * Q + u * u * Q + eta).
  { replace f1 with (p1 * wy t - q) by lra. lra. }
  set (g := multiply e1 (wy t)). assert (Fg : number g) by apply number_round.
  assert (Ng : Rabs (e1 * wy t - g) <= u * u * Q + eta).
  { apply Rle_trans with (1 := multiply_near _ _).
    assert (u * Rabs (e1 * wy t) <= u * (u * Q + eta)) by (apply Rmult_le_compat_l; lra). lra. }
  assert (Bg : Rabs g <= u * Q + u * u * Q + 2 * eta).
  { replace g with (e1 * wy t - (e1 * wy t - g)) by ring. apply Rle_trans with (1 := Rabs_triang _ _).
    rewrite Rabs_Ropp. lra. }
  set (h := add f1 g). assert (Fh : number h) by apply number_round.
  assert (Sfg : Rabs (f1 + g) <= 2 * (u * Q) + 2 * (u * u * Q) + 3 * eta).
  { apply Rle_trans with (1 := Rabs_triang _ _). lra. }
  assert (uuuQ : u * u * u * Q <= u * u * Q * / 1048576).
  { replace (u * u * Q * / 1048576) with (u * u * / 1048576 * Q) by ring. apply Rmult_le_compat_r; lra. }
  assert (Nh : Rabs (f1 + g - h) <= 2 * (u * u * Q) + / 16 * (u * u * Q)).
  { apply Rle_trans with (1 := add_near f1 g Ff Fg).
    apply Rle_trans with (u * (2 * (u * Q) + 2 * (u * u * Q) + 3 * eta)); [apply Rmult_le_compat_l; lra |].
    replace (u * (2 * (u * Q) + 2 * (u * u * Q) + 3 * eta)) with
      (2 * (u * u * Q) + 2 * (u * u * u * Q) + 3 * (u * eta)) by ring. lra. }
  assert (uuQ' : u * u * Q <= / 1048576 * (u * Q)).
  { replace (u * u * Q) with (u * (u * Q)) by ring. apply Rmult_le_compat_r; [apply Rmult_le_pos; lra | rewrite Uv;
      lra]. }
  assert (Bh : Rabs h <= 2 * (u * Q) + 5 * (u * u * Q)).
  { replace h with (f1 + g - (f1 + g - h)) by ring. apply Rle_trans with (1 := Rabs_triang _ _). rewrite Rabs_Ropp.
    lra. }
  assert (Q_low : (1 - 3 * u) * Q <= Rabs q).
  { replace q with (p1 * wy t - (p1 * wy t - q)) by ring.
    pose proof (Rabs_triang_inv (p1 * wy t) (p1 * wy t - q)). lra. }
  assert (Fb : number (q * U)).
  { apply mult_bpow_exact_FLT; [exact Fq |]. apply Z.le_trans with (2 := Hl).
    assert (-4 < mag radix2 q)%Z; [| lia]. apply mag_gt_bpow. simpl.
    assert (3 * u * Q <= / 1048576) by (rewrite <- (Rmult_1_r (/ 1048576)); apply Rmult_le_compat; try lra;
      rewrite Uv; lra). lra. }
  assert (Eb : multiply q U = q * U) by (unfold multiply; apply round_generic; [typeclasses eauto | exact Fb]).
  rewrite Eb. set (C := multiply h U).
  assert (AbsU : forall x, Rabs (x * U) = Rabs x * U) by (intro x; rewrite Rabs_mult, (Rabs_pos_eq U); lra).
  assert (NC : Rabs (h * U - C) <= u * (Rabs h * U) + / 2 * eta) by (rewrite <- AbsU; apply multiply_near).
  assert (BU : forall a b, a <= b -> a * U <= b * U) by (intros; apply Rmult_le_compat_r; lra).
  pose proof (BU _ _ Q_low) as QU. pose proof (BU _ _ Bh) as hU.
  assert (V0 : 0 <= Q * U) by (apply Rmult_le_pos; lra).
  assert (uV : u * (Q * U) <= / 1048576 * (Q * U)) by (apply Rmult_le_compat_r; [lra | rewrite Uv; lra]).
  assert (V1 : Q * U <= Rabs q * U + 4 * u * (Rabs q * U)).
  { assert (uB : 0 <= u * (Rabs q * U)) by (apply Rmult_le_pos; [lra |]; apply Rmult_le_pos; [apply Rabs_pos | lra]).
    assert (K : u * ((1 - 3 * u) * Q * U) <= u * (Rabs q * U)) by (apply Rmult_le_compat_l; lra).
    replace (u * ((1 - 3 * u) * Q * U)) with (u * (Q * U) - 3 * (u * (u * (Q * U)))) in K by ring.
    assert (u * (u * (Q * U)) <= u * (/ 1048576 * (Q * U))) by (apply Rmult_le_compat_l; lra). lra. }
  set (B := Rabs q * U) in *. assert (B0 : 0 <= B) by (apply Rmult_le_pos; [apply Rabs_pos | lra]).
  assert (uB : 0 <= u * B) by (apply Rmult_le_pos; lra).
  assert (uuB : u * (u * B) <= / 1048576 * (u * B)) by (apply Rmult_le_compat_r; [lra | rewrite Uv; lra]).
  assert (uuB0 : 0 <= u * (u * B)) by (apply Rmult_le_pos; lra).
  assert (uuuB : u * (u * (u * B)) <= / 1048576 * (u * (u * B))) by (apply Rmult_le_compat_r; [lra | rewrite Uv; lra]).
  assert (V2 : u * (Q * U) <= u * B + 4 * (u * (u * B))) by (apply (Rmult_le_compat_l u) in V1; lra).
  assert (V3 : u * (u * (Q * U)) <= u * (u * B) + 4 * (u * (u * (u * B)))) by (apply (Rmult_le_compat_l u) in V2; lra).
  assert (uhU : u * (Rabs h * U) <= u * ((2 * (u * Q) + 5 * (u * u * Q)) * U)) by (apply Rmult_le_compat_l; lra).
  assert (V4 : u * (u * (u * (Q * U))) <= / 1048576 * (u * (u * (Q * U)))).
  { apply Rmult_le_compat_r; [| rewrite Uv; lra]. apply Rmult_le_pos; [lra |]. apply Rmult_le_pos; lra. }
  assert (Nvalue : Rabs (wx t * wm t * wy t - (q + h)) * U <= (4 * (u * u * Q)) * U).
  { apply BU. replace (wx t * wm t * wy t - (q + h)) with ((e1 * wy t - g) + (f1 + g - h)) by lra.
    apply Rle_trans with (1 := Rabs_triang _ _). lra. }
  split; [| split; [exact Fb |]].
  - unfold fits; cbn [p e c weight]. rewrite AbsU. fold B.
    assert (Fz : number 0) by apply generic_format_0. assert (FC : number C) by apply number_round.
    repeat split; try assumption; try lra.
    + rewrite Rabs_R0. lra.
    + replace C with (h * U - (h * U - C)) by ring. apply Rle_trans with (1 := Rabs_triang _ _).
    rewrite Rabs_Ropp, AbsU. lra.
  - rewrite AbsU. fold B. unfold value. fold U.
    replace (wx t * wm t * wy t * U - (q * U + 0 + C)) with ((wx t * wm t * wy t - (q + h)) * U + (h * U - C)) by ring.
    apply Rle_trans with (1 := Rabs_triang _ _). rewrite AbsU. lra.
Qed.

(* What remains of `wide_gain`'s radius, n kept and N - n omitted terms; S = the sum of |q 2^k|. *)
Definition theta := 1 + / 262144.
Definition tau := bpow radix2 (-800).
Definition wide_low n S := theta * low_bound S theta 0 (4 * u) eta n S.
Definition wide_error n S := error_bound S theta 0 (4 * u) eta n S + (9 * u * u * S + n * (/ 2 * eta)).
Definition wide_radius n N S := (1 - u) * ((1 - u) * ((1 - u) ^ 4 * ((n + 5) * (n + 5)) * (u * u) * ((1 - / 1048576)
  * S)) - / 2 * eta +
  ((1 - u) * ((N + 5) * tau) - / 2 * eta)).

Lemma wide_margin n N S : 0 <= n <= N -> N <= 8589934592 -> 0 <= S ->
  wide_error n S + (N - n) * (/ 2 * tau) + u * wide_low n S <= (1 - u) * wide_radius n N S.
Proof.
  intros Hn HN HS.
  assert (A : forall m, wide_error m S + u * wide_low m S =
    S * (theta * u * (2 * (m * (u * theta) + u) + 4 * u + m * (m + 1) / 2 * (u * theta) + m * (5 * u)) + 9 * u * u +
         u * theta * (m * (u * theta) + 5 * u)) +
    eta * (theta * u * (m + m * (m + 1) / 2) + m / 2 + u * theta * m)).
  { intro m. unfold wide_error, wide_low, error_bound, low_bound. field. }
  assert (C : theta * u * (2 * (n * (u * theta) + u) + 4 * u + n * (n + 1) / 2 * (u * theta) + n * (5 * u))
    + 9 * u * u +
         u * theta * (n * (u * theta) + 5 * u) <=
         (1 - u) * ((1 - u) * ((1 - u) * ((1 - u) ^ 4 * ((n + 5) * (n + 5)) * (u * u) * (1 - / 1048576))))).
  { unfold theta. rewrite u_value. assert (0 <= n * n) by (apply Rmult_le_pos; lra). lra. }
  assert (E' : eta <= tau * (u * u)).
  { unfold eta, tau. apply Rle_trans with (bpow radix2 (-800) * bpow radix2 (-200)).
    - rewrite <- bpow_plus. apply bpow_le. lia.
    - apply Rmult_le_compat_l; [apply bpow_ge_0 |]. rewrite u_value. simpl. lra. }
  pose proof E' as E. pose proof eta_positive.
  assert (T : 0 < tau) by apply bpow_gt_0.
  assert (D : (theta * u * (n + n * (n + 1) / 2) + n / 2 + u * theta * n) * (u * u) + 2 * (u * u) + (N - n)
    * / 2 <= (1 - u) * ((1 - u) * ((1 - u) * (N + 5)))).
  { unfold theta. rewrite u_value. assert (n * n <= 8589934592 * n) by (apply Rmult_le_compat_r; lra). lra. }
  assert (F : 0 <= theta * u * (n + n * (n + 1) / 2) + n / 2 + u * theta * n).
  { unfold theta. rewrite u_value. assert (0 <= n * n) by (apply Rmult_le_pos; lra). lra. }
  apply (Rmult_le_compat_l S _ _ HS) in C. apply (Rmult_le_compat_l tau) in D; [| lra].
  apply (Rmult_le_compat_r _ _ _ F) in E.
  assert (G : (1 - u) * ((1 - u) * (/ 2 * eta + / 2 * eta)) <= 1 * (1 * eta)).
  { pose proof u_positive. assert (u <= 1) by (rewrite u_value; lra).
    apply Rmult_le_compat; try lra; [apply Rmult_le_pos; lra |]. apply Rmult_le_compat; lra. }
  pose proof (A n) as A'. unfold wide_radius. lra.
Qed.

(* The sum of `wide_gain`: kept terms, whose exponents are at least -800, and omitted ones. *)
Definition wide_size kept := fold_left add (map (fun t => Rabs (p (term_of t))) kept) 0.
Definition wide_upper kept N :=
  let s := summed (map term_of kept) in
  add (fst s) (add (snd s) (add (multiply (multiply (multiply (multiply (N + 5) (N + 5)) u) u) (wide_size kept))
    (multiply (N + 5) tau))).

Lemma wide_accepted kept omitted : let N := INR (length kept) + INR (length omitted) in
  N <= 8589934592 -> Forall well kept -> Forall well omitted ->
  Forall (fun t => (-800 <= wk t)%Z) kept -> Forall (fun t => (wk t <= -801)%Z) omitted ->
  wide_upper kept N <= 0 -> over value kept + over value omitted <= 0.
Proof.
  intros N HN WK WO LK LO. unfold wide_upper. set (s := summed (map term_of kept)). set (n := INR (length kept)) in *.
  pose proof u_positive as Hu. pose proof eta_positive as He. pose proof small_eta as Hs. pose proof u_value as Uv.
  assert (n0 : 0 <= n) by apply pos_INR. assert (o0 : 0 <= INR (length omitted)) by apply pos_INR.
  assert (HnN : n <= N) by (unfold N; lra).
  assert (K : Forall (fun t => fits 0 (4 * u) eta (term_of t) /\ number (p (term_of t)) /\
    Rabs (value t - (p (term_of t) + e (term_of t) + c (term_of t))) <= 9 * u * u * weight (term_of t) + / 2 * eta)
      kept).
  { rewrite Forall_forall in *. intros t Ht. apply term_fits; [apply WK | apply LK]; exact Ht. }
  set (S := weights (map term_of kept)).
  assert (SV : S = over (fun t => Rabs (p (term_of t))) kept).
  { unfold S. clear. induction kept as [| t kept IH]; [reflexivity |]. cbn [map weights fold_right over].
    fold (weights (map term_of kept)). fold (over (fun t => Rabs (p (term_of t))) kept). rewrite IH. reflexivity. }
  assert (S0 : 0 <= S) by (rewrite SV; apply over_positive, Forall_forall; intros; apply Rabs_pos).
  assert (Power : (1 + u) ^ (length kept + 2) <= theta).
  { apply Rle_trans with (1 + 2 * INR (length kept + 2) * u).
    - apply power_grown. rewrite plus_INR. fold n. simpl. rewrite Uv. lra.
    - rewrite plus_INR. fold n. simpl. unfold theta. rewrite Uv. lra. }
  destruct (compensated (map term_of kept) theta 0 (4 * u) eta) as (Ex & _ & Lo); try lra.
  { rewrite map_length. exact Power. }
  { apply Forall_map. apply Forall_impl with (2 := K). intros t Ht. apply Ht. }
  rewrite map_length in Ex, Lo. fold n S s in Ex, Lo.
  assert (Kept : Rabs (over value kept - exact (map term_of kept)) <= 9 * u * u * S + n * (/ 2 * eta)).
  { unfold S, n. clear - K. induction K as [| t kept (_ & _ & B) K IH]; [simpl; rewrite Rminus_0_r, Rabs_R0; lra |].
    cbn [map weights fold_right over exact length]. fold (weights (map term_of kept)). fold (over value kept).
    fold (exact (map term_of kept)).
    rewrite S_INR.
    match goal with |- Rabs ?x <= _ => replace x with
      ((value t - (p (term_of t) + e (term_of t) + c (term_of t))) + (over value kept - exact (map term_of kept))) by
        ring end.
    apply Rle_trans with (1 := Rabs_triang _ _). lra. }
  assert (T0 : 0 < tau) by apply bpow_gt_0.
  assert (Omitted : Rabs (over value omitted) <= INR (length omitted) * (/ 2 * tau)).
  { clear - WO LO T0. induction omitted as [| t omitted IH]; [simpl; rewrite Rabs_R0; lra |].
    inversion WO as [| t1 l1 Wt WO']; subst. inversion LO as [| t2 l2 Lt LO']; subst. specialize (IH WO' LO').
    cbn [over fold_right length]. fold (over value omitted). rewrite S_INR.
    apply Rle_trans with (1 := Rabs_triang _ _).
    assert (V : Rabs (value t) <= / 2 * tau); [| lra].
    destruct Wt as ((_ & Bx) & (_ & Bm) & (_ & By) & _). unfold value.
    rewrite !Rabs_mult, (Rabs_pos_eq (bpow radix2 (wk t))) by apply bpow_ge_0.
    assert (bpow radix2 (wk t) <= / 2 * tau).
    { replace (/ 2 * tau) with (bpow radix2 (-801)) by (unfold tau; change (/ 2) with (bpow radix2 (-1));
        rewrite <- bpow_plus; reflexivity).
      apply bpow_le. exact Lt. }
    rewrite <- (Rmult_1_l (/ 2 * tau)). apply Rmult_le_compat; [| apply bpow_ge_0 | | assumption].
    - repeat apply Rmult_le_pos; apply Rabs_pos.
    - rewrite <- (Rmult_1_l 1). apply Rmult_le_compat; try lra; [apply Rmult_le_pos; apply Rabs_pos |].
      rewrite <- (Rmult_1_l 1). apply Rmult_le_compat; try lra; apply Rabs_pos. }
  assert (Size : (1 - / 1048576) * S <= wide_size kept).
  { unfold wide_size. rewrite SV, <- (over_map (fun t => Rabs (p (term_of t)))).
    assert (FS : Forall (fun x => number x /\ 0 <= x) (map (fun t => Rabs (p (term_of t))) kept)).
    { apply Forall_map. apply Forall_impl with (2 := K). intros t (_ & F & _). split;
        [apply generic_format_abs, F | apply Rabs_pos]. }
    apply Rle_trans with (2 := sum_kept _ FS 0 (generic_format_0 _ _) (Rle_refl 0)). rewrite Rplus_0_l.
    apply Rmult_le_compat_r; [rewrite over_map, <- SV; exact S0 |]. rewrite map_length.
    apply Rle_trans with (2 := power_kept (length kept)). fold n. rewrite Uv. lra. }
  set (size := wide_size kept) in *.
  assert (Size0 : 0 <= size) by (apply Rle_trans with (2 := Size); apply Rmult_le_pos; lra).
  set (a := N + 5). assert (Ha : n + 5 <= a) by (unfold a; lra).
  assert (u1 : 0 <= 1 - u) by (rewrite Uv; lra).
  assert (aa : (n + 5) * (n + 5) <= a * a) by (apply Rmult_le_compat; lra).
  assert (aa25 : 25 <= (n + 5) * (n + 5)) by (replace 25 with (5 * 5) by lra; apply Rmult_le_compat; lra).
  pose proof (multiply_kept a a ltac:(apply Rmult_le_pos; lra)) as M1.
  set (m1 := multiply a a) in *.
  assert (e25 : forall x, 25 <= x -> / 2 * eta <= u * u * (u * x) * / 256).
  { intros x Hx. assert (u * u * u * 25 <= u * u * u * x) by (apply Rmult_le_compat_l; [repeat (apply Rmult_le_pos;
      [| lra]); lra | exact Hx]). lra. }
  set (x := (n + 5) * (n + 5)) in *.
  assert (X1 : (1 - u) * x - / 2 * eta <= m1).
  { assert ((1 - u) * x <= (1 - u) * (a * a)) by (apply Rmult_le_compat_l; lra). lra. }
  assert (ux : 0 <= u * x) by (apply Rmult_le_pos; lra). assert (uux : 0 <= u * (u * x)) by (apply Rmult_le_pos; lra).
  assert (uuux : 0 <= u * (u * (u * x))) by (apply Rmult_le_pos; lra).
  pose proof (e25 x aa25) as ex.
  assert (uux1 : u * (u * x) <= / 1048576 * (u * x)) by (apply Rmult_le_compat_r; [lra | rewrite Uv; lra]).
  assert (uuux1 : u * (u * (u * x)) <= / 1048576 * (u * (u * x))) by (apply Rmult_le_compat_r; [lra | rewrite Uv; lra]).
  assert (ux1 : u * x <= / 1048576 * x) by (apply Rmult_le_compat_r; [lra | rewrite Uv; lra]).
  assert (m1_0 : 0 <= m1) by lra.
  pose proof (multiply_kept m1 u ltac:(apply Rmult_le_pos; lra)) as M2. set (m2 := multiply m1 u) in *.
  assert (uM1 : u * ((1 - u) * x - / 2 * eta) <= u * m1) by (apply Rmult_le_compat_l; lra).
  apply (Rmult_le_compat_l (1 - u) _ _ u1) in uM1.
  assert (ue : 0 <= u * eta <= eta) by (split; [apply Rmult_le_pos; lra | rewrite <- (Rmult_1_l eta) at 2;
    apply Rmult_le_compat_r; lra]).
  assert (uue : 0 <= u * (u * eta) <= u * eta) by (split; [apply Rmult_le_pos; lra | apply Rmult_le_compat_l; lra]).
  assert (X2 : (1 - u) ^ 2 * (u * x) - eta <= m2) by lra.
  assert (m2_0 : 0 <= m2) by lra.
  pose proof (multiply_kept m2 u ltac:(apply Rmult_le_pos; lra)) as M3. set (m3 := multiply m2 u) in *.
  assert (uM2 : u * ((1 - u) ^ 2 * (u * x) - eta) <= u * m2) by (apply Rmult_le_compat_l; lra).
  apply (Rmult_le_compat_l (1 - u) _ _ u1) in uM2.
  assert (X3 : (1 - u) ^ 4 * x * (u * u) <= m3).
  { assert (Y : (1 - u) ^ 3 * (u * (u * x)) - 2 * eta <= m3) by lra.
    assert (Z : u * ((1 - / 4) * (u * (u * x))) <= u * ((1 - u) ^ 3 * (u * (u * x)))).
    { apply Rmult_le_compat_l; [lra |]. apply Rmult_le_compat_r; [exact uux |]. rewrite Uv. lra. }
    replace ((1 - u) ^ 4 * x * (u * u)) with
      ((1 - u) ^ 3 * (u * (u * x)) - u * ((1 - u) ^ 3 * (u * (u * x)))) by ring. lra. }
  assert (m3_0 : 0 <= m3).
  { apply Rle_trans with (2 := X3). apply Rmult_le_pos; [apply Rmult_le_pos; [apply pow_le;
      lra | lra] | apply Rmult_le_pos; lra]. }
  pose proof (multiply_kept m3 size ltac:(apply Rmult_le_pos; lra)) as M4. set (r1 := multiply m3 size) in *.
  pose proof (multiply_kept a tau ltac:(apply Rmult_le_pos; lra)) as M5. set (r2 := multiply a tau) in *.
  assert (X4 : (1 - u) ^ 4 * x * (u * u) * ((1 - / 1048576) * S) <= m3 * size).
  { apply Rmult_le_compat; try lra.
    apply Rmult_le_pos; [apply Rmult_le_pos; [apply pow_le; lra | lra] | apply Rmult_le_pos; lra]. }
  apply (Rmult_le_compat_l (1 - u) _ _ u1) in X4.
  assert (P1 : 0 <= r1) by (apply multiply_positive, Rmult_le_pos; lra).
  assert (P2 : 0 <= r2) by (apply multiply_positive, Rmult_le_pos; lra).
  assert (Fr1 : number r1) by apply number_round. assert (Fr2 : number r2) by apply number_round.
  pose proof (add_near r1 r2 Fr1 Fr2) as Nr. rewrite (Rabs_pos_eq (r1 + r2)) in Nr by lra.
  pose proof (Rle_abs (r1 + r2 - add r1 r2)) as Nr'.
  set (radius := add r1 r2) in *.
  assert (R : (1 - u) * wide_radius n N S <= (1 - u) * radius).
  { apply Rmult_le_compat_l; [exact u1 |]. unfold wide_radius. fold a x.
    apply Rle_trans with ((1 - u) * (r1 + r2)); [apply Rmult_le_compat_l; [exact u1 |]; lra | lra]. }
  assert (Rad : 0 <= radius) by (assert (0 <= (1 - u) * (r1 + r2)) by (apply Rmult_le_pos; lra); lra).
  pose proof (wide_margin n N S (conj n0 HnN) HN S0) as Mg. unfold wide_error, wide_low in Mg.
  assert (Fs : number (fst s) /\ number (snd s)) by (apply summed_numbers).
  apply (accepted_never_gains _ (fst s) (snd s) radius); try apply Fs; [apply number_round |].
  assert (Lo' : u * Rabs (snd s) <= u * (theta * low_bound S theta 0 (4 * u) eta n S)) by (apply Rmult_le_compat_l;
    lra).
  assert (T : u * Rabs (snd s + radius) <= u * Rabs (snd s) + u * radius).
  { rewrite <- Rmult_plus_distr_l. apply Rmult_le_compat_l; [lra |]. apply Rle_trans with (1 := Rabs_triang _ _).
    rewrite (Rabs_pos_eq radius Rad). lra. }
  replace (over value kept + over value omitted - (fst s + snd s)) with
    ((exact (map term_of kept) - (fst s + snd s)) + (over value kept - exact (map term_of kept)) + over value omitted)
      by ring.
  assert (No : INR (length omitted) = N - n) by (unfold N; ring). rewrite No in Omitted.
  pose proof (Rabs_triang (exact (map term_of kept) - (fst s + snd s) + (over value kept - exact (map term_of kept)))
    (over value omitted)).
  pose proof (Rabs_triang (exact (map term_of kept) - (fst s + snd s)) (over value kept - exact (map term_of kept))).
  lra.
Qed.

(* `_half`: w + v as a pair, through quarters where both are large. *)
Definition halves (w v : R) :=
  if Rlt_bool (bpow radix2 900) (Rmin (Rabs w) (Rabs v))
  then let s := two_sum (multiply (/ 4) w) (multiply (/ 4) v) in (4 * fst s, 4 * snd s) else two_sum w v.

Lemma quarter_exact x : number x -> bpow radix2 900 < Rabs x -> number (/ 4 * x) /\ multiply (/ 4) x = / 4 * x.
Proof.
  intros F B. assert (K : number (/ 4 * x)).
  { replace (/ 4 * x) with (x * bpow radix2 (-2)) by (simpl; lra). apply mult_bpow_exact_FLT; [exact F |].
    assert (900 < mag radix2 x)%Z by (apply mag_gt_bpow; lra). lia. }
  split; [exact K |]. apply round_generic; [typeclasses eauto | exact K].
Qed.

Lemma four_times x : number x -> number (4 * x).
Proof. intro F. replace (4 * x) with (x * bpow radix2 2) by (simpl; lra). apply mult_bpow_pos_exact_FLT;
  [exact F | lia]. Qed.

Lemma halves_exact w v : number w -> number v ->
  number (fst (halves w v)) /\ number (snd (halves w v)) /\ fst (halves w v) + snd (halves w v) = w + v.
Proof.
  intros Fw Fv. unfold halves. destruct (Rlt_bool_spec (bpow radix2 900) (Rmin (Rabs w) (Rabs v))) as [L | _].
  - destruct (quarter_exact w Fw) as (Qw & ->); [apply Rlt_le_trans with (1 := L); apply Rmin_l |].
    destruct (quarter_exact v Fv) as (Qv & ->); [apply Rlt_le_trans with (1 := L); apply Rmin_r |].
    cbv zeta; cbn [fst snd]. repeat split; try (apply four_times, number_round).
    rewrite <- Rmult_plus_distr_l, two_sum_exact by assumption. lra.
  - repeat split; try apply number_round. apply two_sum_exact; assumption.
Qed.

(* frexp: x = mantissa · 2^exponent with the mantissa in [1/2, 1). *)
Definition exponent x : Z := mag radix2 x.
Definition significand x := x * bpow radix2 (- exponent x).

Lemma significand_exact x : x = significand x * bpow radix2 (exponent x).
Proof. unfold significand. rewrite Rmult_assoc, <- bpow_plus, Z.add_opp_diag_l. simpl. ring. Qed.

Lemma significand_mantissa x : number x -> x <> 0 -> mantissa (significand x).
Proof.
  intros F Z. unfold significand, exponent. destruct (mag radix2 x) as (k & B); simpl. specialize (B Z).
  assert (H : / 2 <= Rabs (x * bpow radix2 (- k)) <= 1).
  { rewrite Rabs_mult, (Rabs_pos_eq (bpow _ _)) by apply bpow_ge_0. split.
    - apply Rle_trans with (bpow radix2 (k - 1) * bpow radix2 (- k)).
      + rewrite <- bpow_plus. replace (k - 1 + - k)%Z with (-1)%Z by lia. simpl. lra.
      + apply Rmult_le_compat_r; [apply bpow_ge_0 | apply B].
    - apply Rle_trans with (bpow radix2 k * bpow radix2 (- k)).
      + apply Rmult_le_compat_r; [apply bpow_ge_0 | lra].
      + rewrite <- bpow_plus, Z.add_opp_diag_r. simpl. lra. }
  split; [| exact H].
  apply generic_format_FLT_FLX.
  - apply Rle_trans with (2 := proj1 H). apply Rle_trans with (bpow radix2 (-1)); [apply bpow_le; lia | simpl; lra].
  - apply mult_bpow_exact_FLX. apply generic_format_FLX_FLT with (1 := F).
Qed.

(* The eight products of an entry, as pairs of halves; those that vanish are left out. *)
Definition pairs (a b : (R * R) * (R * R)) : list (R * R) :=
  let '((dh, dl), _) := a in let '(_, (sh, sl)) := b in
  let '(_, (sh', sl')) := a in let '((dh', dl'), _) := b in
  [(dh, sh); (dl, sh); (dh, sl); (dl, sl); (sh', dh'); (sl', dh'); (sh', dl'); (sl', dl')].
Definition vanishes (x : R * R * R) := Req_bool (fst (fst x)) 0 || Req_bool (snd (fst x)) 0 || Req_bool (snd x) 0.
Definition products d (M : nat -> nat -> R) v w : list (R * R * R) :=
  let half i := (halves (w i) (- v i), halves (w i) (v i)) in
  filter (fun x => negb (vanishes x))
    (flat_map (fun i => flat_map (fun j => map (fun y => (fst y, M i j, snd y)) (pairs (half i) (half j))) (seq 0 d))
      (seq 0 d)).
Definition scaled_by top (x : R * R * R) := let '(a, m, b) := x in
  Scaled (significand a) (significand m) (significand b) (exponent a + exponent m + exponent b - top).
Definition is_kept t := Z.leb (-800) (wk t).

Lemma over_app {X} (f : X -> R) k l : over f (k ++ l) = over f k + over f l.
Proof. induction k as [| x k IH]; simpl; [ring | rewrite IH; ring]. Qed.
Lemma over_flat_map {X Y} (f : Y -> R) (g : X -> list Y) l : over f (flat_map g l) = over (fun x => over f (g x)) l.
Proof. induction l as [| x l IH]; [reflexivity |]. cbn [flat_map]. rewrite over_app, IH. reflexivity. Qed.
Lemma over_of_map {X Y} (f : Y -> R) (g : X -> Y) l : over f (map g l) = over (fun x => f (g x)) l.
Proof. induction l as [| x l IH]; simpl; [reflexivity | rewrite IH; reflexivity]. Qed.
Lemma over_filter {X} (f : X -> R) (b : X -> bool) l : over f l = over f (filter b l)
  + over f (filter (fun x => negb (b x)) l).
Proof. induction l as [| x l IH]; simpl; [ring |]. destruct (b x); simpl; rewrite IH; ring. Qed.

Definition product3 (x : R * R * R) := fst (fst x) * snd (fst x) * snd x.

Lemma products_sum d M v w : (forall i, number (v i)) -> (forall i, number (w i)) ->
  over product3 (products d M v w) = 2 * (quadratic d M w - quadratic d M v).
Proof.
  intros Fv Fw. rewrite <- four_times_gain. unfold products.
  set (all := flat_map _ (seq 0 d)).
  assert (Z : over product3 (filter (fun x => negb (vanishes x)) all) = over product3 all).
  { rewrite (over_filter product3 (fun x => negb (vanishes x)) all).
    assert (N : over product3 (filter (fun x => negb (negb (vanishes x))) all) = 0); [| lra].
    clear. induction all as [| [[a m] b] l IH]; [reflexivity |]. simpl. unfold vanishes at 1; simpl.
    destruct (Req_bool_spec a 0), (Req_bool_spec m 0), (Req_bool_spec b 0); simpl; rewrite ?IH; subst;
      unfold product3; simpl; ring. }
  rewrite Z. unfold all. rewrite over_flat_map.
  transitivity (over (fun i => over (fun j => M i j * ((w i - v i) * (w j + v j) + (w i + v i) * (w j - v j)))
    (seq 0 d)) (seq 0 d)).
  { apply over_equal. intro i. rewrite over_flat_map. apply over_equal. intro j. rewrite over_of_map.
    destruct (halves_exact (w i) (- v i) (Fw i) (number_opposite _ (Fv i))) as (_ & _ & E1).
    destruct (halves_exact (w i) (v i) (Fw i) (Fv i)) as (_ & _ & E2).
    destruct (halves_exact (w j) (- v j) (Fw j) (number_opposite _ (Fv j))) as (_ & _ & E3).
    destruct (halves_exact (w j) (v j) (Fw j) (Fv j)) as (_ & _ & E4).
    destruct (halves (w i) (- v i)) as [a b], (halves (w i) (v i)) as [a' b'], (halves (w j) (- v j))
      as [c d'], (halves (w j) (v j)) as [c' d''].
    cbn [fst snd] in *. unfold product3; cbn.
    replace (w i - v i) with (a + b) by lra. replace (w i + v i) with (a' + b') by lra.
    replace (w j - v j) with (c + d') by lra. replace (w j + v j) with (c' + d'') by lra. ring. }
  transitivity (over (fun i => over (fun j => M i j * ((w i - v i) * (w j + v j))) (seq 0 d)) (seq 0 d) +
                over (fun i => over (fun j => M i j * ((w i + v i) * (w j - v j))) (seq 0 d)) (seq 0 d)).
  { rewrite <- over_sum. apply over_equal. intro i. rewrite <- over_sum. apply over_equal. intro j. ring. }
  rewrite (over_swapped (fun i j => M i j * ((w i + v i) * (w j - v j)))).
  rewrite <- over_sum. apply over_equal. intro i. rewrite <- over_sum, <- over_scaled. apply over_equal. intro j. ring.
Qed.

Lemma products_well d M v w top : let all := map (scaled_by top) (products d M v w) in
  (forall i j, number (M i j)) -> (forall i, number (v i)) -> (forall i, number (w i)) ->
  Forall (fun t => (wk t <= 0)%Z) all -> Forall well all.
Proof.
  intros all FM Fv Fw Top.
  unfold all in *. apply Forall_map. rewrite Forall_map in Top. rewrite Forall_forall in *. intros [[a m] b] Hx.
  specialize (Top _ Hx).
    apply filter_In in Hx. destruct Hx as (Hx & V). cbn [scaled_by wk] in Top.
    apply in_flat_map in Hx. destruct Hx as (i & _ & Hx). apply in_flat_map in Hx. destruct Hx as (j & _ & Hx).
    apply in_map_iff in Hx. destruct Hx as ([a' b'] & E & Hx). cbn [fst snd] in E. injection E as <- <- <-.
    assert (F : number a' /\ number b').
    { destruct (halves_exact (w i) (- v i) (Fw i) (number_opposite _ (Fv i))) as (A1 & A2 & _).
      destruct (halves_exact (w i) (v i) (Fw i) (Fv i)) as (A3 & A4 & _).
      destruct (halves_exact (w j) (- v j) (Fw j) (number_opposite _ (Fv j))) as (A5 & A6 & _).
      destruct (halves_exact (w j) (v j) (Fw j) (Fv j)) as (A7 & A8 & _).
      destruct (halves (w i) (- v i)), (halves (w i) (v i)), (halves (w j) (- v j)), (halves (w j) (v j)).
      cbn [pairs In fst snd] in *. repeat (destruct Hx as [Hx | Hx]; [injection Hx as <- <-; auto |]). destruct Hx. }
    unfold vanishes in V; cbn [fst snd] in V.
    destruct (Req_bool_spec a' 0), (Req_bool_spec (M i j) 0), (Req_bool_spec b' 0); try discriminate.
    unfold well; cbn [scaled_by wx wm wy wk]. repeat split; try (apply significand_mantissa; auto; apply F); assumption.
Qed.

Lemma wide_never_gains d M v w top : let all := map (scaled_by top) (products d M v w) in
  (forall i j, number (M i j)) -> (forall i, number (v i)) -> (forall i, number (w i)) ->
  INR (length all) <= 8589934592 -> Forall (fun t => (wk t <= 0)%Z) all ->
  wide_upper (filter is_kept all) (INR (length all)) <= 0 -> quadratic d M w <= quadratic d M v.
Proof.
  intros all FM Fv Fw HN Top H.
  assert (W : Forall well all) by (apply products_well; assumption).
  assert (V : over product3 (products d M v w) = over value all * bpow radix2 top).
  { unfold all. rewrite over_of_map, Rmult_comm, <- over_scaled. apply over_equal. intros [[a m] b].
    unfold product3, value; cbn [scaled_by wx wm wy wk fst snd].
    replace (exponent a + exponent m + exponent b - top)%Z with
      (exponent a + (exponent m + (exponent b + - top)))%Z by lia.
    rewrite !bpow_plus. rewrite (significand_exact a) at 1. rewrite (significand_exact m) at 1.
    rewrite (significand_exact b) at 1.
    assert (U : bpow radix2 top * bpow radix2 (- top) = 1) by (rewrite <- bpow_plus, Z.add_opp_diag_r; reflexivity).
    transitivity (significand a * bpow radix2 (exponent a) * (significand m * bpow radix2 (exponent m)) *
      (significand b * bpow radix2 (exponent b)) * (bpow radix2 top * bpow radix2 (- top))); [rewrite U; ring | ring]. }
  rewrite (products_sum d M v w Fv Fw) in V.
  assert (S : over value all <= 0).
  { rewrite (over_filter value is_kept all).
    assert (L : length all = (length (filter is_kept all) + length (filter (fun t => negb (is_kept t)) all))%nat).
    { clear. induction all as [| t l IH]; [reflexivity |]. simpl. destruct (is_kept t); simpl; lia. }
    rewrite L, plus_INR in HN, H. apply wide_accepted; try assumption.
    - apply Forall_forall. intros t Ht. apply filter_In in Ht. exact (proj1 (Forall_forall _ _) W t (proj1 Ht)).
    - apply Forall_forall. intros t Ht. apply filter_In in Ht. exact (proj1 (Forall_forall _ _) W t (proj1 Ht)).
    - apply Forall_forall. intros t Ht. apply filter_In in Ht. apply Z.leb_le, Ht.
    - apply Forall_forall. intros t Ht. apply filter_In in Ht. destruct Ht as (_ & Ht).
      apply negb_true_iff, Z.leb_gt in Ht. lia. }
  assert (B : 0 < bpow radix2 top) by apply bpow_gt_0.
  assert (over value all * bpow radix2 top <= 0 * bpow radix2 top) by (apply Rmult_le_compat_r; lra). lra.
Qed.

(* `wide_gain` never overflows. Its halves: *)
Notation limit := (bpow radix2 1024).

Lemma nearest x g r : number g -> Rabs (x - g) <= r -> Rabs (rnd x - x) <= r.
Proof.
  intros Fg H. destruct (round_N_pt radix2 fexp (fun z => negb (Z.even z)) x) as (_ & N).
  apply Rle_trans with (1 := N g Fg). rewrite Rabs_minus_sym. exact H.
Qed.

Lemma near_finite (x y : binary64) g r :
  is_finite x = true -> is_finite y = true -> number g -> Rabs g + 2 * r < limit ->
  (Rabs (B2R x + B2R y - g) <= r -> is_finite (plus x y) = true /\ Rabs (B2R (plus x y) - g) <= 2 * r) /\
  (Rabs (B2R x - B2R y - g) <= r -> is_finite (minus x y) = true /\ Rabs (B2R (minus x y) - g) <= 2 * r).
Proof.
  intros Fx Fy Fg L.
  assert (N : forall z, Rabs (z - g) <= r -> Rabs (rnd z) < limit /\ Rabs (rnd z - g) <= 2 * r).
  { intros z H. pose proof (nearest z g r Fg H) as K.
    assert (D : Rabs (rnd z - g) <= 2 * r).
    { replace (rnd z - g) with ((rnd z - z) + (z - g)) by ring. apply Rle_trans with (1 := Rabs_triang _ _). lra. }
    split; [| exact D]. replace (rnd z) with (g + (rnd z - g)) by ring.
    apply Rle_lt_trans with (1 := Rabs_triang _ _). lra. }
  split; intro H; destruct (N _ H) as (B & D); apply Rlt_bool_true in B.
  - pose proof (Bplus_correct 53 1024 _ _ mode_NE x y Fx Fy) as C. change (round_mode mode_NE) with ZnearestE in C.
    change (SpecFloat.fexp 53 1024) with fexp in C. rewrite B in C. destruct C as (E & F & _). split; [exact F |].
    change (plus x y) with (Bplus mode_NE x y). rewrite E. exact D.
  - pose proof (Bminus_correct 53 1024 _ _ mode_NE x y Fx Fy) as C. change (round_mode mode_NE) with ZnearestE in C.
    change (SpecFloat.fexp 53 1024) with fexp in C. rewrite B in C. destruct C as (E & F & _). split; [exact F |].
    change (minus x y) with (Bminus mode_NE x y). rewrite E. exact D.
Qed.

Lemma number_B2R (x : binary64) : number (B2R x).
Proof. apply generic_format_B2R. Qed.

Lemma sum2_finite (a b : binary64) r : is_finite a = true -> is_finite b = true ->
  Rabs (rnd (B2R a + B2R b) - (B2R a + B2R b)) <= r ->
  Rabs (B2R a) + 32 * r < limit -> Rabs (B2R b) + 32 * r < limit -> Rabs (B2R a + B2R b) + r < limit ->
  is_finite (fst (sum2 binary64 a b)) = true /\ is_finite (snd (sum2 binary64 a b)) = true.
Proof.
  intros Fa Fb H La Lb Ls. assert (r0 : 0 <= r) by (apply Rle_trans with (2 := H); apply Rabs_pos).
  pose proof (Rabs_pos (B2R a)). pose proof (Rabs_pos (B2R b)).
  unfold sum2; cbv zeta; cbn [fst snd]. set (s := plus a b).
  assert (Fs : is_finite s = true /\ B2R s = rnd (B2R a + B2R b)).
  { pose proof (Bplus_correct 53 1024 _ _ mode_NE a b Fa Fb) as C. change (round_mode mode_NE) with ZnearestE in C.
    change (SpecFloat.fexp 53 1024) with fexp in C. rewrite Rlt_bool_true in C; [split; apply C |].
    replace (rnd (B2R a + B2R b)) with ((B2R a + B2R b) + (rnd (B2R a + B2R b) - (B2R a + B2R b))) by ring.
    apply Rle_lt_trans with (1 := Rabs_triang _ _). lra. }
  destruct Fs as (Fs & Es). rewrite <- Es in H.
  assert (F0 : number 0) by apply generic_format_0.
  destruct (near_finite s a (B2R b) r Fs Fa (number_B2R b) ltac:(lra)) as (_ & T).
  destruct T as (Ft & Nt). { replace (B2R s - B2R a - B2R b) with (B2R s - (B2R a + B2R b)) by ring. exact H. }
  set (t := minus s a) in *.
  destruct (near_finite s t (B2R a) (3 * r) Fs Ft (number_B2R a) ltac:(lra)) as (_ & Z).
  destruct Z as (Fz & Nz).
  { replace (B2R s - B2R t - B2R a) with ((B2R s - (B2R a + B2R b)) + - (B2R t - B2R b)) by ring.
    apply Rle_trans with (1 := Rabs_triang _ _). rewrite Rabs_Ropp. lra. }
  set (z := minus s t) in *.
  destruct (near_finite a z 0 (6 * r) Fa Fz F0) as (_ & C). { rewrite Rabs_R0. lra. }
  destruct C as (Fc & Nc). { rewrite Rminus_0_r, Rabs_minus_sym. lra. }
  destruct (near_finite b t 0 (2 * r) Fb Ft F0) as (_ & D). { rewrite Rabs_R0. lra. }
  destruct D as (Fd & Nd). { rewrite Rminus_0_r, Rabs_minus_sym. lra. }
  destruct (near_finite (minus a z) (minus b t) 0 (16 * r) Fc Fd F0) as (E & _). { rewrite Rabs_R0. lra. }
  destruct E as (Fe & _).
  { rewrite Rminus_0_r in *. apply Rle_trans with (1 := Rabs_triang _ _). lra. }
  split; assumption.
Qed.

(* One of them at most 2^900, or quarters: no sum of `_half` overflows, so its halves are those of [halves]. *)
Lemma largest_double (x : binary64) : Rabs (B2R x) <= limit - bpow radix2 971.
Proof. exact (abs_B2R_le_emax_minus_prec 53 1024 _ x). Qed.

Lemma halves_finite (w v : binary64) : is_finite w = true -> is_finite v = true ->
  Rmin (Rabs (B2R w)) (Rabs (B2R v)) <= bpow radix2 900 \/
  (Rabs (B2R w) <= bpow radix2 1022 /\ Rabs (B2R v) <= bpow radix2 1022) ->
  is_finite (fst (sum2 binary64 w v)) = true /\ is_finite (snd (sum2 binary64 w v)) = true.
Proof.
  intros Fw Fv H.
  assert (B1 : bpow radix2 900 * 64 <= bpow radix2 971).
  { change 64 with (bpow radix2 6). rewrite <- bpow_plus. apply bpow_le. lia. }
  assert (B0 : 0 < bpow radix2 900) by apply bpow_gt_0.
  pose proof (largest_double w) as Lw. pose proof (largest_double v) as Lv.
  destruct H as [H | (Hw & Hv)].
  - apply (sum2_finite w v (bpow radix2 900)); try assumption; try lra.
    + unfold Rmin in H; destruct (Rle_dec (Rabs (B2R w)) (Rabs (B2R v))).
      * apply (nearest _ (B2R v)); [apply number_B2R |]. replace (B2R w + B2R v - B2R v) with (B2R w) by ring. exact H.
      * apply (nearest _ (B2R w)); [apply number_B2R |]. replace (B2R w + B2R v - B2R w) with (B2R v) by ring. exact H.
    + apply Rle_lt_trans with (Rabs (B2R w) + Rabs (B2R v) + bpow radix2 900); [apply Rplus_le_compat_r, Rabs_triang |].
      unfold Rmin in H; destruct (Rle_dec (Rabs (B2R w)) (Rabs (B2R v))); lra.
  - assert (L : limit = 4 * bpow radix2 1022) by (change 4 with (bpow radix2 2); rewrite <- bpow_plus; reflexivity).
    assert (P : 0 < bpow radix2 1022) by apply bpow_gt_0.
    assert (S : Rabs (B2R w + B2R v) <= 2 * bpow radix2 1022) by (apply Rle_trans with (1 := Rabs_triang _ _); lra).
    pose proof u_positive.
    assert (U : 64 * (u * (2 * bpow radix2 1022)) <= bpow radix2 1022) by (rewrite u_value; lra).
    apply (sum2_finite w v (u * (2 * bpow radix2 1022))); try assumption; try lra.
    rewrite Rabs_minus_sym. apply Rle_trans with (1 := add_near _ _ (number_B2R w) (number_B2R v)).
    apply Rmult_le_compat_l; lra.
Qed.

(* The loop over the kept terms (x, m, y, 2^k), in any arithmetic. *)
Section Wide_code.
Variable T : arithmetic.
Definition wide_step (state : T * T * T) (x : T * T * T * T) : T * T * T :=
  let '(h, l, size) := state in let '(a, m, b, unit) := x in
  let pe := product2 T a m in let qf := product2 T (fst pe) b in
  let f := plus (snd qf) (times (snd pe) b) in
  let big := times (fst qf) unit in let ht := sum2 T h big in
  (fst ht, plus l (plus (snd ht) (times f unit)), plus size (absolute big)).
Definition wide_code (n unit floor : T) (terms : list (T * T * T * T)) : T :=
  let '(h, l, size) := fold_left wide_step terms (nought, nought, nought) in
  plus h (plus l (plus (times (times (times (times n n) unit) unit) size) (times n floor))).
End Wide_code.

Definition within r (x : binary64) := is_finite x = true /\ Rabs (B2R x) <= r.

Lemma within_operation (x y : binary64) c : is_finite x = true -> is_finite y = true -> number c -> c <= bpow radix2
  1000 ->
  (Rabs (B2R x + B2R y) <= c -> within c (plus x y)) /\ (Rabs (B2R x - B2R y) <= c -> within c (minus x y)) /\
  (Rabs (B2R x * B2R y) <= c -> within c (times x y)).
Proof.
  intros Fx Fy Fc Lc.
  assert (N : forall z, Rabs z <= c -> Rabs (rnd z) <= c /\ Rlt_bool (Rabs (rnd z)) limit = true).
  { intros z H. assert (K : Rabs (rnd z) <= c) by (apply abs_round_le_generic;
      [typeclasses eauto .. | exact Fc | exact H]).
    split; [exact K |]. apply Rlt_bool_true. apply Rle_lt_trans with (1 := K), Rle_lt_trans with (1 := Lc), bpow_lt.
    lia. }
  unfold within. repeat split; intros; destruct (N _ H) as (K & B).
  1, 2: pose proof (Bplus_correct 53 1024 _ _ mode_NE x y Fx Fy) as C.
  3, 4: pose proof (Bminus_correct 53 1024 _ _ mode_NE x y Fx Fy) as C.
  5, 6: pose proof (Bmult_correct 53 1024 _ _ mode_NE x y) as C.
  all: change (round_mode mode_NE) with ZnearestE in C; change (SpecFloat.fexp 53 1024) with fexp in C; rewrite B in C;
    destruct C as (E & F & _).
  - exact F.
  - change (plus x y) with (Bplus mode_NE x y). rewrite E. exact K.
  - exact F.
  - change (minus x y) with (Bminus mode_NE x y). rewrite E. exact K.
  - change (times x y) with (Bmult mode_NE x y). rewrite F, Fx, Fy. reflexivity.
  - change (times x y) with (Bmult mode_NE x y). rewrite E. exact K.
Qed.

Lemma within_plus a b c (x y : binary64)
  : within a x -> within b y -> a + b <= c -> number c -> c <= bpow radix2 1000 -> within c (plus x y).
Proof. intros (Fx & Bx) (Fy & By) H Fc L. apply within_operation;
  try assumption. apply Rle_trans with (1 := Rabs_triang _ _). lra. Qed.

Notation below k x := (within (bpow radix2 k) x).
Lemma number_bpow k : (-1074 <= k)%Z -> number (bpow radix2 k).
Proof. intro H. apply generic_format_bpow. unfold fexp, FLT_exp. lia. Qed.
Lemma bpow_sum i j k : (i < k)%Z -> (j < k)%Z -> bpow radix2 i + bpow radix2 j <= bpow radix2 k.
Proof.
  intros Hi Hj. assert (bpow radix2 i <= bpow radix2 (k - 1) /\ bpow radix2 j <= bpow radix2 (k - 1)) by (split;
    apply bpow_le; lia).
  replace k with ((k - 1) + 1)%Z by lia. rewrite bpow_plus. simpl (bpow radix2 1). lra.
Qed.
Lemma below_plus i j k (x y : binary64) : below i x -> below j y -> (i < k)%Z -> (j < k)%Z -> (-1074 <= k <= 1000)%Z
  -> below k (plus x y).
Proof.
  intros (Fx & Bx) (Fy & By) Hi Hj Hk. apply within_operation; try assumption; [apply number_bpow;
    lia | apply bpow_le; lia |].
  apply Rle_trans with (1 := Rabs_triang _ _). pose proof (bpow_sum i j k Hi Hj). lra.
Qed.
Lemma below_minus i j k (x y : binary64)
  : below i x -> below j y -> (i < k)%Z -> (j < k)%Z -> (-1074 <= k <= 1000)%Z -> below k (minus x y).
Proof.
  intros (Fx & Bx) (Fy & By) Hi Hj Hk. apply within_operation; try assumption; [apply number_bpow;
    lia | apply bpow_le; lia |].
  apply Rle_trans with (1 := Rabs_triang _ _). rewrite Rabs_Ropp. pose proof (bpow_sum i j k Hi Hj). lra.
Qed.
Lemma below_times i j k (x y : binary64)
  : below i x -> below j y -> (i + j <= k)%Z -> (-1074 <= k <= 1000)%Z -> below k (times x y).
Proof.
  intros (Fx & Bx) (Fy & By) Hi Hk. apply within_operation; try assumption; [apply number_bpow; lia | apply bpow_le;
    lia |].
  rewrite Rabs_mult. apply Rle_trans with (bpow radix2 i * bpow radix2 j).
  - apply Rmult_le_compat; try apply Rabs_pos; assumption.
  - rewrite <- bpow_plus. apply bpow_le. lia.
Qed.

Lemma below_split : below 28 (@split binary64).
Proof. split; [reflexivity |]. rewrite (same_split eq_refl). change (@split unbounded) with splitter. unfold splitter.
rewrite Rabs_pos_eq; simpl; lra. Qed.

Lemma product2_below (x y : binary64) : below 2 x -> below 2 y -> below 4 (fst (product2 binary64 x y))
  /\ below 70 (snd (product2 binary64 x y)).
Proof.
  intros Hx Hy. unfold product2; cbv zeta; cbn [fst snd].
  assert (P : below 4 (times x y)) by (apply (below_times 2 2); auto; lia).
  assert (H : forall z, below 2 z -> below 32 (high2 binary64 z)).
  { intros z Hz. unfold high2; cbv zeta. assert (below 30 (times split z)) by (apply (below_times 28 2);
      auto using below_split; lia).
    apply (below_minus 30 31); auto; try lia. apply (below_minus 30 2); auto; lia. }
  pose proof (H x Hx) as A. pose proof (H y Hy) as B. set (a := high2 binary64 x) in *.
  set (b := high2 binary64 y) in *.
  assert (A' : below 33 (minus x a)) by (apply (below_minus 2 32); auto; lia).
  assert (B' : below 33 (minus y b)) by (apply (below_minus 2 32); auto; lia).
  split; [exact P |].
  apply (below_plus 69 66); try lia; [| apply (below_times 33 33); auto; lia].
  apply (below_plus 68 65); try lia; [| apply (below_times 33 32); auto; lia].
  apply (below_plus 67 65); try lia; [| apply (below_times 32 33); auto; lia].
  apply (below_minus 64 4); auto; try lia. apply (below_times 32 32); auto; lia.
Qed.

Definition mild (x : binary64 * binary64 * binary64 * binary64) :=
  below 0 (fst (fst (fst x))) /\ below 0 (snd (fst (fst x))) /\ below 0 (snd (fst x)) /\ below 0 (snd x).
Definition bounded_state k (s : binary64 * binary64 * binary64) :=
  within (INR k * bpow radix2 5) (fst (fst s)) /\ within (INR k * bpow radix2 75) (snd (fst s))
    /\ within (INR k * bpow radix2 5) (snd s).

Lemma below_more i k (x : binary64) : below i x -> (i <= k)%Z -> below k x.
Proof. intros (F & B) H. split; [exact F | apply Rle_trans with (1 := B), bpow_le, H]. Qed.

Lemma number_multiple k i : INR k <= 17179869184 -> (0 <= i <= 100)%Z ->
  number (INR k * bpow radix2 i) /\ INR k * bpow radix2 i <= bpow radix2 (34 + i).
Proof.
  intros H Hi. split.
  - rewrite INR_IZR_INZ. rewrite INR_IZR_INZ in H. apply le_IZR in H.
    apply generic_format_FLT. exists (Float radix2 (Z.of_nat k) i); [reflexivity | simpl; lia | simpl; lia].
  - rewrite bpow_plus. apply Rmult_le_compat_r; [apply bpow_ge_0 |]. simpl (bpow radix2 34). lra.
Qed.

Lemma wide_step_bounded k s x : INR (S k) <= 17179869184 -> bounded_state k s -> mild x -> bounded_state (S k)
  (wide_step binary64 s x).
Proof.
  intros HK (Hh & Hl & Hz) (Ha & Hm & Hb & Hu). destruct s as [[h l] z], x as [[[a m] b] unit]; cbn [fst snd] in *.
  unfold wide_step; cbv zeta.
  assert (Hk : INR k <= 17179869184) by (rewrite S_INR in HK; lra).
  assert (P : below 0 (fst (product2 binary64 a m))) by (apply (below_times 0 0); auto; lia).
  destruct (product2_below a m) as (_ & E); try (eapply below_more; [eassumption | lia]).
  set (p1 := fst (product2 binary64 a m)) in *. set (e1 := snd (product2 binary64 a m)) in *.
  assert (Q : below 0 (fst (product2 binary64 p1 b))) by (apply (below_times 0 0); auto; lia).
  destruct (product2_below p1 b) as (_ & F); try (eapply below_more; [eassumption | lia]).
  set (q := fst (product2 binary64 p1 b)) in *. set (f1 := snd (product2 binary64 p1 b)) in *.
  set (f := plus f1 (times e1 b)).
  assert (Hf : below 71 f) by (apply (below_plus 70 70); auto; try lia; apply (below_times 70 0); auto; lia).
  set (big := times q unit). assert (Hq : below 0 big) by (apply (below_times 0 0); auto; lia).
  assert (N5 := fun j H => number_multiple j 5 H ltac:(lia)).
  assert (N75 := fun j H => number_multiple j 75 H ltac:(lia)).
  assert (One5 : bpow radix2 0 <= bpow radix2 5) by (apply bpow_le; lia).
  assert (L5 : forall j, INR j <= 17179869184 -> INR j * bpow radix2 5 <= bpow radix2 1000).
  { intros j Hj. apply Rle_trans with (1 := proj2 (N5 j Hj)), bpow_le. lia. }
  assert (L75 : forall j, INR j <= 17179869184 -> INR j * bpow radix2 75 <= bpow radix2 1000).
  { intros j Hj. apply Rle_trans with (1 := proj2 (N75 j Hj)), bpow_le. lia. }
  assert (h39 : below 39 h) by (split; [apply Hh | apply Rle_trans with (1 := proj2 Hh), (N5 k Hk)]).
  unfold sum2; cbv zeta; cbn [fst snd].
  assert (s1 : within (INR (S k) * bpow radix2 5) (plus h big)).
  { apply (within_plus _ _ _ _ _ Hh Hq); [rewrite S_INR; lra | apply N5, HK | apply L5, HK]. }
  set (s := plus h big) in *.
  assert (s39 : below 39 s) by (split; [apply s1 | apply Rle_trans with (1 := proj2 s1), (N5 (S k) HK)]).
  assert (t40 : below 40 (minus s h)) by (apply (below_minus 39 39); auto; lia). set (t := minus s h) in *.
  assert (z41 : below 41 (minus s t)) by (apply (below_minus 39 40); auto; lia).
  assert (r : below 50 (plus (minus h (minus s t)) (minus big t))).
  { apply (below_plus 42 41); try lia; [apply (below_minus 39 41) | apply (below_minus 0 40)]; auto; lia. }
  unfold bounded_state; cbn [fst snd]. repeat split; try apply s1.
  - apply (within_plus _ _ (INR (S k) * bpow radix2 75)
      _ _ Hl (below_plus 50 71 75 _ _ r (below_times 71 0 71 _ _ Hf Hu ltac:(lia) ltac:(lia)) ltac:(lia) ltac:(lia)
        ltac:(lia)));
      [rewrite S_INR; lra | apply N75, HK | apply L75, HK].
  - apply (within_plus _ _ (INR (S k) * bpow radix2 75)
      _ _ Hl (below_plus 50 71 75 _ _ r (below_times 71 0 71 _ _ Hf Hu ltac:(lia) ltac:(lia)) ltac:(lia) ltac:(lia)
        ltac:(lia)));
      [rewrite S_INR; lra | apply N75, HK | apply L75, HK].
  - apply (within_plus _ (bpow radix2 0) (INR (S k) * bpow radix2 5) _ (absolute big) Hz); [| rewrite S_INR;
      lra | apply N5, HK | apply L5, HK].
    split; [change (is_finite (Babs big) = true); rewrite is_finite_Babs;
      apply Hq | change (absolute big) with (Babs big); rewrite B2R_Babs, Rabs_Rabsolu; apply Hq].
  - apply (within_plus _ (bpow radix2 0) (INR (S k) * bpow radix2 5) _ (absolute big) Hz); [| rewrite S_INR;
      lra | apply N5, HK | apply L5, HK].
    split; [change (is_finite (Babs big) = true); rewrite is_finite_Babs;
      apply Hq | change (absolute big) with (Babs big); rewrite B2R_Babs, Rabs_Rabsolu; apply Hq].
Qed.

Lemma wide_loop_bounded terms : forall k s, INR (k + length terms)
  <= 17179869184 -> bounded_state k s -> Forall mild terms ->
  bounded_state (k + length terms) (fold_left (wide_step binary64) terms s).
Proof.
  induction terms as [| x terms IH]; intros k s HK Hs F; simpl in *; [rewrite Nat.add_0_r; exact Hs |].
  inversion F; subst. replace (k + S (length terms))%nat with (S k + length terms)%nat in * by lia.
  apply IH; try assumption. apply wide_step_bounded; try assumption.
  apply Rle_trans with (2 := HK). apply le_INR. lia.
Qed.

Lemma wide_finite n unit floor terms : INR (length terms) <= 8589934592 -> Forall mild terms ->
  below 40 n -> below 0 unit -> below 0 floor -> is_finite (wide_code binary64 n unit floor terms) = true.
Proof.
  intros HN F Hn Hu Hf. unfold wide_code.
  assert (B : bounded_state (0 + length terms) (fold_left (wide_step binary64) terms (nought, nought, nought))).
  { apply wide_loop_bounded; [change (0 + length terms)%nat with (length terms); lra | | exact F].
    unfold bounded_state, within; cbn [fst snd]. simpl. rewrite Rabs_R0, !Rmult_0_l. repeat split; lra. }
  destruct (fold_left (wide_step binary64) terms _) as [[h l] z]. destruct B as (Bh & Bl & Bz); cbn [fst snd] in *.
  simpl in Bh, Bl, Bz. assert (HN' : INR (length terms) <= 17179869184) by lra.
  assert (h39 : below 39 h) by (split; [apply Bh | apply Rle_trans with (1 := proj2 Bh), (number_multiple _ 5 HN');
    lia]).
  assert (z39 : below 39 z) by (split; [apply Bz | apply Rle_trans with (1 := proj2 Bz), (number_multiple _ 5 HN');
    lia]).
  assert (l109 : below 109 l) by (split; [apply Bl | apply Rle_trans with (1 := proj2 Bl), (number_multiple _ 75 HN');
    lia]).
  assert (R : below 200 (plus h (plus l (plus (times (times (times (times n n) unit) unit) z) (times n floor)))));
    [| apply R].
  apply (below_plus 39 150); try lia; [exact h39 |]. apply (below_plus 109 140); try lia; [exact l109 |].
  apply (below_plus 130 40); try lia; [| apply (below_times 40 0); auto; lia].
  apply (below_times 80 39); try lia; [| exact z39]. apply (below_times 80 0); try lia; [| exact Hu].
  apply (below_times 80 0); try lia; [| exact Hu]. apply (below_times 40 40); auto; lia.
Qed.

Definition four (t : scaled) : R * R * R * R := (wx t, wm t, wy t, bpow radix2 (wk t)).

Lemma wide_step_unbounded (h l z : R) t :
  wide_step unbounded (h, l, z) (four t) = (step (h, l) (term_of t), add z (Rabs (p (term_of t)))).
Proof.
  unfold wide_step, four, term_of. rewrite !product2_unbounded. cbv zeta. unfold step; cbn [p e c fst snd].
  change (times ?a ?b) with (multiply a b). rewrite sum2_unbounded. f_equal. f_equal.
  change (@plus unbounded) with add. f_equal.
  match goal with |- _ = add (add ?s 0) _ => replace (add s 0) with s; [reflexivity |] end.
  symmetry. unfold add at 1. rewrite Rplus_0_r. apply round_generic; [typeclasses eauto | apply number_round].
Qed.

Lemma wide_unbounded kept N : wide_code unbounded (N + 5) u tau (map four kept) = wide_upper kept N.
Proof.
  assert (L : forall h l z : R, fold_left (wide_step unbounded) (map four kept) (h, l, z) =
    (fold_left step (map term_of kept) (h, l), fold_left add (map (fun t => Rabs (p (term_of t))) kept) z)).
  { induction kept as [| t kept IH]; intros h l z; [reflexivity |]. cbn [map fold_left].
    rewrite (wide_step_unbounded h l z t). destruct (step (h, l) (term_of t)) as [h' l']. apply IH. }
  unfold wide_code, wide_upper, wide_size, summed.
  replace (fold_left (wide_step unbounded) (map four kept) (nought, nought, nought)) with
    (fold_left step (map term_of kept) (0, 0), fold_left add (map (fun t => Rabs (p (term_of t))) kept) 0) by
      (symmetry; exact (L 0 0 0)).
  destruct (fold_left step (map term_of kept) (0, 0)) as [h l]. reflexivity.
Qed.

Definition is_four (x : binary64 * binary64 * binary64 * binary64) (t : scaled) :=
  let '(a, m, b, unit) := x in
  (is_finite a = true /\ B2R a = wx t) /\ (is_finite m = true /\ B2R m = wm t) /\ (is_finite b = true /\ B2R b = wy t)
    /\
  (is_finite unit = true /\ B2R unit = bpow radix2 (wk t)).

#[local] Hint Resolve same_plus same_minus same_times same_absolute same_opposite same_nought same_one same_split :
  same.

Lemma same_sum2 a b a' b' : same a a' -> same b b' ->
  same (fst (sum2 binary64 a b)) (fst (sum2 unbounded a' b')) /\ same (snd (sum2 binary64 a b))
    (snd (sum2 unbounded a' b')).
Proof. intros. unfold sum2; cbv zeta; cbn [fst snd]. auto 30 with same. Qed.

Lemma same_product2 a b a' b' : same a a' -> same b b' ->
  same (fst (product2 binary64 a b)) (fst (product2 unbounded a' b')) /\
  same (snd (product2 binary64 a b)) (snd (product2 unbounded a' b')).
Proof. intros. unfold product2, high2; cbv zeta; cbn [fst snd]. auto 30 with same. Qed.

Lemma same_wide_step s s' x x' : same3 s s' -> same4 x x' -> same3 (wide_step binary64 s x) (wide_step unbounded s' x').
Proof.
  destruct s as [[h l] z], s' as [[h' l'] z'], x as [[[a m] b] k], x' as [[[a' m'] b'] k'].
  unfold same4, same3; cbn [fst snd]. intros (Hh & Hl & Hz) ((Ha & Hm & Hb) & Hk). unfold wide_step; cbv zeta.
  destruct (same_product2 _ _ _ _ Ha Hm) as (P & E).
  destruct (product2 binary64 a m) as [p1 e1], (product2 unbounded a' m') as [p1' e1']; cbn [fst snd] in *.
  destruct (same_product2 _ _ _ _ P Hb) as (Q & F).
  destruct (product2 binary64 p1 b) as [q f], (product2 unbounded p1' b') as [q' f']; cbn [fst snd] in *.
  destruct (same_sum2 _ _ _ _ Hh (same_times _ _ _ _ Q Hk)) as (S & R).
  destruct (sum2 binary64 h (times q k)) as [h1 t], (sum2 unbounded h' (times q' k')) as [h1' t']; cbn [fst snd] in *.
  auto 10 with same.
Qed.

Lemma same_wide_code n unit floor n' unit' floor' terms terms' : same n n' -> same unit unit' -> same floor floor' ->
  Forall2 same4 terms terms' -> same (wide_code binary64 n unit floor terms)
    (wide_code unbounded n' unit' floor' terms').
Proof.
  intros Hn Hu Hf H. unfold wide_code.
  assert (I : same3 (fold_left (wide_step binary64) terms (nought, nought, nought))
                    (fold_left (wide_step unbounded) terms' (nought, nought, nought))).
  { apply (same_fold same3 same4); [exact same_wide_step | exact H |]. unfold same3; cbn [fst snd]. auto with same. }
  destruct (fold_left (wide_step binary64) terms _) as [[h l] z], (fold_left (wide_step unbounded) terms' _)
    as [[h' l'] z'].
  destruct I as (I1 & I2 & I3); cbn [fst snd] in *. auto 20 with same.
Qed.

(* What `wide_gain` accepts: its bound is finite, and shows that nothing is gained where it is at most 0. *)
Theorem wide_never_gains_in_binary64 d M v w top (n unit floor : double) terms :
  let all := map (scaled_by top) (products d M v w) in
  (forall i j, number (M i j)) -> (forall i, number (v i)) -> (forall i, number (w i)) ->
  INR (length all) <= 8589934592 -> Forall (fun t => (wk t <= 0)%Z) all -> Forall2 is_four terms (filter is_kept all) ->
  is_finite n = true -> B2R n = INR (length all) + 5 -> is_finite unit = true -> B2R unit = u ->
  is_finite floor = true -> B2R floor = tau ->
  let bound := wide_code binary64 n unit floor terms in
  is_finite bound = true /\ (B2R bound <= 0 -> quadratic d M w <= quadratic d M v).
Proof.
  intros all FM Fv Fw HN Top H Fn En Fu Eu Ff Ef bound.
  assert (W : Forall well all) by (apply products_well; assumption).
  assert (Len : length terms = length (filter is_kept all)).
  { clear - H. induction H as [| x t l l' _ _ IH]; [reflexivity | exact (f_equal S IH)]. }
  assert (K : forall l : list scaled, (length (filter is_kept l) <= length l)%nat).
  { induction l as [| t l IH]; simpl; [lia |]. destruct (is_kept t); simpl; lia. }
  assert (Mild : Forall mild terms).
  { assert (W' : Forall well (filter is_kept all)).
    { apply Forall_forall. intros t Ht. apply filter_In in Ht. exact (proj1 (Forall_forall _ _) W t (proj1 Ht)). }
    clear - H W'. induction H as [| [[[a m] b] k] t terms l Hx H IH]; [constructor |].
    inversion W' as [| t1 l1 ((_ & Ba) & (_ & Bm) & (_ & Bb) & Hk) W1]; subst. constructor; [| apply IH, W1].
    destruct Hx as ((F1 & E1) & (F2 & E2) & (F3 & E3) & (F4 & E4)).
    assert (bpow radix2 0 = 1) as O by reflexivity. unfold mild, within; cbn [fst snd]. rewrite E1, E2, E3, E4, O.
    repeat split; try assumption; try lra. rewrite Rabs_pos_eq by apply bpow_ge_0. rewrite <- O. apply bpow_le, Hk. }
  assert (Finite : is_finite bound = true).
  { apply wide_finite; [| exact Mild | | |].
    - apply Rle_trans with (2 := HN), le_INR. rewrite Len. apply K.
    - split; [exact Fn |]. rewrite En, Rabs_pos_eq by (pose proof (pos_INR (length all)); lra). simpl. lra.
    - split; [exact Fu |]. rewrite Eu, u_value. rewrite Rabs_pos_eq; simpl; lra.
    - split; [exact Ff |]. rewrite Ef. unfold tau. rewrite Rabs_pos_eq by apply bpow_ge_0. apply bpow_le. lia. }
  split; [exact Finite |]. intro B. apply (wide_never_gains d M v w top); try assumption. fold all.
  rewrite <- wide_unbounded, <- En, <- Eu, <- Ef.
  rewrite <- (same_wide_code n unit floor (B2R n) (B2R unit) (B2R floor) terms (map four (filter is_kept all)));
    try exact (fun _ => eq_refl); try assumption.
  clear - H. induction H as [| [[[a m] b] k] t terms l Hx H IH]; [constructor |]. cbn [map]. constructor; [| exact IH].
  destruct Hx as ((F1 & E1) & (F2 & E2) & (F3 & E3) & (F4 & E4)). unfold same4, same3, same, four; cbn [fst snd]. auto.
Qed.
Print Assumptions wide_never_gains_in_binary64. (* the bound that `wide_gain` computes in binary64 is finite;
  if it is at
   most 0, then wᵀMw ≤ vᵀMv over the real numbers *)
Print Assumptions halves_finite. (* w − v and w + v, of quarters where both are above 2⁹⁰⁰, never overflow in
  `wide_gain` *)
