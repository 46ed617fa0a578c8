(* The arithmetic under the last step of the resolver (iapb/contact/kernels/passive.py, iapb/numerics/double_double.py), in binary64
   with rounding to nearest and gradual underflow, for every size d.

   Proved here: [two_sum] is exact; [two_product] is exact where nothing underflows, and within 7/2 of the smallest number
   always; [compensated], the running bound by induction on the number of terms; [loop_error], the error of either loop of
   `gain`; [gain_error], the error of `gain` as a whole; [accepted_never_gains], what the comparison with 0 shows.

   Numbers are real numbers of binary64's format whose exponent has no upper end; Accepted.v adds overflow. *)

From Coq Require Import ZArith Reals List Lia Lra Psatz.
From Flocq Require Import Core Relative Plus_error Pff2Flocq.
Import ListNotations.
Open Scope R_scope.

Definition fexp := FLT_exp (-1074) 53.
Notation number := (generic_format radix2 fexp).
Notation rnd := (round radix2 fexp ZnearestE).
Definition u := (/ 2 * bpow radix2 (- (53) + 1)).   (* 2^-53 *)
Definition eta := bpow radix2 (-1074).              (* the smallest number *)

#[export] Instance prec_positive : Prec_gt_0 53 := eq_refl.

Definition add x y := rnd (x + y).
Definition subtract x y := rnd (x - y).
Definition multiply x y := rnd (x * y).

(* iapb.numerics.double_double.two_sum and two_product, operation by operation. *)
Definition two_sum a b :=
  let s := add a b in
  let t := subtract s a in
  (s, add (subtract a (subtract s t)) (subtract b t)).

Definition splitter := bpow radix2 27 + 1.
Definition high a := let t := multiply splitter a in subtract t (subtract t a).
Definition two_product a b :=
  let p := multiply a b in
  let a_hi := high a in let a_lo := subtract a a_hi in
  let b_hi := high b in let b_lo := subtract b b_hi in
  (p, add (add (add (subtract (multiply a_hi b_hi) p) (multiply a_hi b_lo)) (multiply a_lo b_hi)) (multiply a_lo b_lo)).

Lemma u_value : u = / 9007199254740992.
Proof. unfold u. simpl. lra. Qed.

Lemma u_positive : 0 < u.
Proof. rewrite u_value. lra. Qed.

Lemma number_round x : number (rnd x).
Proof. apply generic_format_round; typeclasses eauto. Qed.

Lemma even_choice : forall x : Z, negb (Z.even x) = negb (negb (Z.even (- (x + 1)))).
Proof. intro x. rewrite Z.even_opp, Z.even_add. destruct (Z.even x); reflexivity. Qed.

Lemma rnd_opposite x : rnd (- x) = - rnd x.
Proof. apply round_NE_opp. Qed.

Theorem two_sum_exact a b : number a -> number b -> fst (two_sum a b) + snd (two_sum a b) = a + b.
Proof.
  intros Fa Fb. unfold two_sum, add, subtract; simpl fst; simpl snd.
  exact (TwoSum_correct (-1074) 53 (fun x => negb (Z.even x)) ltac:(lia) ltac:(lia) even_choice a b Fa Fb).
Qed.

Lemma high_flocq x : high x = rnd (rnd (x - rnd (x * (bpow radix2 27 + 1))) + rnd (x * (bpow radix2 27 + 1))).
Proof.
  unfold high, subtract, multiply, splitter. rewrite (Rmult_comm _ x).
  set (p := rnd (x * _)).
  replace (p - x) with (- (x - p)) by ring. rewrite rnd_opposite. f_equal. ring.
Qed.

Lemma dekker a b : number a -> number b ->
  (a * b = 0 \/ bpow radix2 (-1074 + 2 * 53 - 1) <= Rabs (a * b) ->
   a * b = fst (two_product a b) + snd (two_product a b)) /\
  Rabs (a * b - (fst (two_product a b) + snd (two_product a b))) <= 7 / 2 * eta.
Proof.
  intros Fa Fb.
  pose proof (Dekker radix2 (-1074) 53 (fun x => negb (Z.even x)) ltac:(lia) ltac:(lia) a b Fa Fb
    (or_introl eq_refl)) as D.
  change (53 - Z.div2 53)%Z with 27%Z in D.
  unfold two_product, add, subtract, multiply; simpl fst; simpl snd.
  rewrite (high_flocq a), (high_flocq b).
  replace (rnd (rnd (rnd (a - rnd (a * (bpow radix2 27 + 1))) + rnd (a * (bpow radix2 27 + 1))) *
           rnd (rnd (b - rnd (b * (bpow radix2 27 + 1))) + rnd (b * (bpow radix2 27 + 1)))) - rnd (a * b))
    with (- rnd (a * b) + rnd (rnd (rnd (a - rnd (a * (bpow radix2 27 + 1))) + rnd (a * (bpow radix2 27 + 1))) *
           rnd (rnd (b - rnd (b * (bpow radix2 27 + 1))) + rnd (b * (bpow radix2 27 + 1))))) by ring.
  exact D.
Qed.

Theorem two_product_exact a b : number a -> number b -> a * b = 0 \/ bpow radix2 (-969) <= Rabs (a * b) ->
  fst (two_product a b) + snd (two_product a b) = a * b.
Proof. intros Fa Fb H. symmetry. apply (dekker a b Fa Fb). exact H. Qed.

Theorem two_product_underflow a b : number a -> number b ->
  Rabs (a * b - (fst (two_product a b) + snd (two_product a b))) <= 7 / 2 * eta.
Proof. intros Fa Fb. apply (dekker a b Fa Fb). Qed.

Print Assumptions two_sum_exact. (* two_sum(a, b) is a + b exactly, in binary64 with gradual underflow *)
Print Assumptions two_product_exact. (* two_product(a, b) is exactly a b if a b is 0 or its magnitude is at
   least 2⁻⁹⁶⁹ *)
Print Assumptions two_product_underflow. (* two_product(a, b) always differs from a b by at most 7/2 · 2⁻¹⁰⁷⁴
   *)

Lemma add_near x y : number x -> number y -> Rabs (x + y - add x y) <= u * Rabs (x + y).
Proof.
  intros Fx Fy. destruct (FLT_plus_error_N_ex radix2 (-1074) 53 (fun z => negb (Z.even z)) x y Fx Fy) as (d & Hd & E).
  change (FLT_exp (-1074) 53) with fexp in E. unfold add. rewrite E. replace (x + y - (x + y) * (1 + d)) with (- d * (x + y)) by ring.
  rewrite Rabs_mult, Rabs_Ropp. apply Rmult_le_compat_r; [apply Rabs_pos |].
  apply Rle_trans with (1 := Hd). apply u_rod1pu_ro_le_u_ro.
Qed.

Lemma add_size x y : number x -> number y -> Rabs (add x y) <= (1 + u) * Rabs (x + y).
Proof.
  intros Fx Fy. replace (add x y) with ((x + y) - (x + y - add x y)) by ring.
  apply Rle_trans with (1 := Rabs_triang _ _). rewrite Rabs_Ropp.
  pose proof (add_near x y Fx Fy). lra.
Qed.

Lemma two_sum_low x y : number x -> number y -> Rabs (snd (two_sum x y)) <= u * Rabs (add x y).
Proof.
  intros Fx Fy. pose proof (two_sum_exact x y Fx Fy) as E.
  destruct (FLT_plus_error_N_round_ex radix2 (-1074) 53 (fun z => negb (Z.even z)) x y Fx Fy) as (d & Hd & D).
  change (FLT_exp (-1074) 53) with fexp in D. fold (add x y) in D.
  change (fst (two_sum x y)) with (add x y) in E. set (t := snd (two_sum x y)) in *.
  replace t with (d * add x y).
  - rewrite Rabs_mult. apply Rmult_le_compat_r; [apply Rabs_pos | exact Hd].
  - lra.
Qed.

(* A term stands for p + e + c; its weight bounds them. h + l stands for the sum: both loops of `gain`. *)
Record term := Term { p : R; e : R; c : R; weight : R }.
Definition step (state : R * R) (x : term) :=
  let ht := two_sum (fst state) (p x) in
  (fst ht, add (snd state) (add (add (snd ht) (e x)) (c x))).
Definition summed (terms : list term) := fold_left step terms (0, 0).
Definition exact (terms : list term) := fold_right (fun x rest => p x + e x + c x + rest) 0 terms.
Definition weights (terms : list term) := fold_right (fun x rest => weight x + rest) 0 terms.

(* |p| <= s, |e| <= u s + b, |c| <= g s + f of a term of weight s: b and f are what underflow adds. *)
Definition fits (b g f : R) (x : term) :=
  number (p x) /\ number (e x) /\ number (c x) /\
  Rabs (p x) <= weight x /\ Rabs (e x) <= u * weight x + b /\ Rabs (c x) <= g * weight x + f.

Section Running_bound.
Variables (S G b g f : R).
Hypotheses (g_positive : 0 <= g) (f_positive : 0 <= f).

Let one := u * (G * S) + b + f.
Definition low_bound (k s : R) := k * one + (u + g) * s.
Definition error_bound (k s : R) :=
  G * u * (2 * (k * (u * (G * S) + b) + u * s) + g * s + k * f + k * (k + 1) / 2 * one + k * ((u + g) * S)).

Definition invariant (k : nat) (s x : R) (state : R * R) :=
  number (fst state) /\ number (snd state) /\ Rabs (fst state) <= (1 + u) ^ k * s /\
  Rabs (snd state) <= (1 + u) ^ (k + 2) * low_bound (INR k) s /\
  Rabs (x - (fst state + snd state)) <= error_bound (INR k) s.

Lemma power_at_least_one k : 1 <= (1 + u) ^ k.
Proof. apply pow_R1_Rle. pose proof u_positive. lra. Qed.

Lemma powers_grow j k : (j <= k)%nat -> (1 + u) ^ j <= (1 + u) ^ k.
Proof. intro H. apply Rle_pow; [pose proof u_positive; lra | exact H]. Qed.

Lemma invariant_step k s x state (y : term) :
  (1 + u) ^ (k + 3) <= G -> 0 <= s -> s + weight y <= S -> fits b g f y -> invariant k s x state ->
  invariant (k + 1) (s + weight y) (x + (p y + e y + c y)) (step state y).
Proof.
  intros HG Hs HS (Fp & Fe & Fc & Hp & He & Hc) (Fh & Fl & Hh & Hl & Hx).
  destruct state as [h l]; simpl fst in *; simpl snd in *.
  unfold step; simpl fst; simpl snd.
  set (w := weight y) in *.
  pose proof u_positive as Hu.
  assert (Hw : 0 <= w) by (apply Rle_trans with (2 := Hp); apply Rabs_pos).
  set (h' := add h (p y)). set (t := snd (two_sum h (p y))).
  assert (Fh' : number h') by apply number_round.
  assert (Ft : number t) by apply number_round.
  assert (E : h' + t = h + p y) by exact (two_sum_exact h (p y) Fh Fp).
  set (q := add t (e y)). assert (Fq : number q) by apply number_round.
  set (r := add q (c y)). assert (Fr : number r) by apply number_round.
  set (l' := add l r). assert (Fl' : number l') by apply number_round.
  pose proof (power_at_least_one k) as P0.
  pose proof (powers_grow 1 (k + 2) ltac:(lia)) as P1. rewrite pow_1 in P1.
  pose proof (powers_grow 2 (k + 2) ltac:(lia)) as P2.
  pose proof (powers_grow (k + 1) (k + 3) ltac:(lia)) as P3.
  pose proof (powers_grow (k + 2) (k + 3) ltac:(lia)) as P4.
  assert (Hh' : Rabs h' <= (1 + u) ^ (k + 1) * (s + w)).
  { apply Rle_trans with (1 := add_size h (p y) Fh Fp). rewrite Nat.add_comm. simpl pow. rewrite Rmult_assoc.
    apply Rmult_le_compat_l; [lra |]. apply Rle_trans with (1 := Rabs_triang _ _).
    assert (w <= (1 + u) ^ k * w) by (rewrite <- (Rmult_1_l w) at 1; apply Rmult_le_compat_r; assumption). lra. }
  assert (HW : Rabs h' <= G * S).
  { apply Rle_trans with (1 := Hh'). apply Rmult_le_compat; [apply pow_le; lra | lra | lra | lra]. }
  assert (Ht : Rabs t <= u * (G * S)).
  { apply Rle_trans with (1 := two_sum_low h (p y) Fh Fp). apply Rmult_le_compat_l; [lra | exact HW]. }
  set (m := u * (G * S) + u * w + b).
  assert (Hte : Rabs (t + e y) <= m).
  { apply Rle_trans with (1 := Rabs_triang _ _). unfold m. lra. }
  assert (m_positive : 0 <= m) by (apply Rle_trans with (2 := Hte); apply Rabs_pos).
  assert (Eq : Rabs (t + e y - q) <= u * m).
  { apply Rle_trans with (1 := add_near t (e y) Ft Fe). apply Rmult_le_compat_l; lra. }
  assert (Sq : Rabs q <= (1 + u) * m).
  { apply Rle_trans with (1 := add_size t (e y) Ft Fe). apply Rmult_le_compat_l; lra. }
  set (n := m + g * w + f).
  assert (gw : 0 <= g * w) by (apply Rmult_le_pos; assumption).
  assert (ugw : 0 <= u * (g * w)) by (apply Rmult_le_pos; lra).
  assert (uf : 0 <= u * f) by (apply Rmult_le_pos; lra).
  assert (n_positive : 0 <= n) by (unfold n; lra).
  assert (Hqc : Rabs (q + c y) <= (1 + u) * n).
  { apply Rle_trans with (1 := Rabs_triang _ _). unfold n. lra. }
  assert (Er : Rabs (q + c y - r) <= u * ((1 + u) * n)).
  { apply Rle_trans with (1 := add_near q (c y) Fq Fc). apply Rmult_le_compat_l; lra. }
  assert (Sr : Rabs r <= (1 + u) ^ 2 * n).
  { apply Rle_trans with (1 := add_size q (c y) Fq Fc). replace ((1 + u) ^ 2 * n) with ((1 + u) * ((1 + u) * n)) by ring.
    apply Rmult_le_compat_l; lra. }
  assert (Sn : (1 + u) ^ 2 * n <= (1 + u) ^ (k + 2) * n) by (apply Rmult_le_compat_r; assumption).
  assert (K : INR (k + 1) = INR k + 1) by (rewrite plus_INR; reflexivity).
  assert (Hlr : Rabs (l + r) <= (1 + u) ^ (k + 2) * low_bound (INR (k + 1)) (s + w)).
  { apply Rle_trans with (1 := Rabs_triang _ _). rewrite K.
    replace (low_bound (INR k + 1) (s + w)) with (low_bound (INR k) s + n) by (unfold low_bound, n, m, one; ring). lra. }
  set (B := low_bound (INR (k + 1)) (s + w)) in *.
  assert (El : Rabs (l + r - l') <= u * ((1 + u) ^ (k + 2) * B)).
  { apply Rle_trans with (1 := add_near l r Fl Fr). apply Rmult_le_compat_l; lra. }
  assert (B_positive : 0 <= B).
  { assert (0 < (1 + u) ^ (k + 2)) by (apply pow_lt; lra).
    apply Rmult_le_reg_l with (1 := H). rewrite Rmult_0_r. apply Rle_trans with (2 := Hlr). apply Rabs_pos. }
  unfold invariant; simpl fst; simpl snd. repeat split; try assumption.
  - apply Rle_trans with (1 := add_size l r Fl Fr).
    replace (k + 1 + 2)%nat with (Datatypes.S (k + 2)) by lia. simpl pow. rewrite Rmult_assoc.
    apply Rmult_le_compat_l; [lra | exact Hlr].
  - change (Rabs (x + (p y + e y + c y) - (h' + l')) <= error_bound (INR (k + 1)) (s + w)).
    replace (x + (p y + e y + c y) - (h' + l')) with
      ((x - (h + l)) + ((t + e y - q) + ((q + c y - r) + (l + r - l')))) by lra.
    apply Rle_trans with (1 := Rabs_triang _ _).
    apply Rle_trans with (error_bound (INR k) s + (u * m + (u * ((1 + u) * n) + u * ((1 + u) ^ (k + 2) * B)))).
    { apply Rplus_le_compat; [exact Hx |]. apply Rle_trans with (1 := Rabs_triang _ _).
      apply Rplus_le_compat; [exact Eq |]. apply Rle_trans with (1 := Rabs_triang _ _). lra. }
    assert (G1 : 1 <= G) by (apply Rle_trans with (2 := HG); apply power_at_least_one).
    assert (A1 : u * m <= u * (G * m)).
    { apply Rmult_le_compat_l; [lra |]. rewrite <- (Rmult_1_l m) at 1. apply Rmult_le_compat_r; assumption. }
    assert (A2 : u * ((1 + u) * n) <= u * (G * n)).
    { apply Rmult_le_compat_l; [lra |]. apply Rmult_le_compat_r; lra. }
    assert (A3 : u * ((1 + u) ^ (k + 2) * B) <= u * (G * B)).
    { apply Rmult_le_compat_l; [lra |]. apply Rmult_le_compat_r; lra. }
    assert (A4 : B <= (INR k + 1) * one + (u + g) * S).
    { unfold B, low_bound. rewrite K. apply Rplus_le_compat_l. apply Rmult_le_compat_l; lra. }
    assert (A5 : u * (G * B) <= u * (G * ((INR k + 1) * one + (u + g) * S))).
    { apply Rmult_le_compat_l; [lra |]. apply Rmult_le_compat_l; lra. }
    apply Rle_trans with (error_bound (INR k) s +
      (u * (G * m) + (u * (G * n) + u * (G * ((INR k + 1) * one + (u + g) * S))))); [lra |].
    right. unfold error_bound, n, m. rewrite K. field.
Qed.

Lemma invariant_run terms : forall k s x state,
  (1 + u) ^ (k + length terms + 2) <= G -> 0 <= s -> s + weights terms <= S -> Forall (fits b g f) terms ->
  invariant k s x state ->
  invariant (k + length terms) (s + weights terms) (x + exact terms) (fold_left step terms state).
Proof.
  induction terms as [| y terms IH]; intros k s x state HG Hs HS HF HI; simpl in *.
  - rewrite Nat.add_0_r, !Rplus_0_r. exact HI.
  - inversion HF as [| y' terms' Fy Fterms]; subst.
    assert (Hw : 0 <= weight y) by (destruct Fy as (_ & _ & _ & Hp & _); apply Rle_trans with (2 := Hp); apply Rabs_pos).
    assert (Hrest : 0 <= weights terms).
    { clear - Fterms. induction terms as [| z terms IH]; simpl; [lra |].
      inversion Fterms as [| z' terms' Fz F]; subst. destruct Fz as (_ & _ & _ & Hp & _).
      assert (0 <= weight z) by (apply Rle_trans with (2 := Hp); apply Rabs_pos). specialize (IH F). lra. }
    replace (k + Datatypes.S (length terms))%nat with (k + 1 + length terms)%nat by lia.
    replace (s + (weight y + weights terms)) with (s + weight y + weights terms) by ring.
    replace (x + (p y + e y + c y + exact terms)) with (x + (p y + e y + c y) + exact terms) by ring.
    apply IH; try assumption; try lra.
    + apply Rle_trans with (2 := HG). apply powers_grow. lia.
    + apply invariant_step; try assumption; try lra.
      apply Rle_trans with (2 := HG). apply powers_grow. lia.
Qed.
End Running_bound.

(* The sum of n terms of total weight S as `gain` computes it: how far it is off, and how large its low part is. *)
Theorem compensated terms G b g f : let n := INR (length terms) in let S := weights terms in
  (1 + u) ^ (length terms + 2) <= G -> 0 <= b -> 0 <= g -> 0 <= f -> Forall (fits b g f) terms ->
  Rabs (exact terms - (fst (summed terms) + snd (summed terms))) <= error_bound S G b g f n S /\
  Rabs (fst (summed terms)) <= G * S /\
  Rabs (snd (summed terms)) <= G * low_bound S G b g f n S.
Proof.
  intros n S HG Hb Hg Hf HF.
  assert (HS : 0 <= S).
  { subst S. clear - HF. induction terms as [| z terms IH]; simpl; [lra |].
    inversion HF as [| z' terms' Fz F]; subst. destruct Fz as (_ & _ & _ & Hp & _).
    assert (0 <= weight z) by (apply Rle_trans with (2 := Hp); apply Rabs_pos). specialize (IH F). lra. }
  assert (Z : number 0) by apply generic_format_0.
  destruct (invariant_run S G b g f Hg Hf terms 0 0 0 (0, 0)) as (_ & _ & Hh & Hl & Hx).
  - simpl. exact HG.
  - lra.
  - simpl. unfold S. lra.
  - exact HF.
  - unfold invariant, low_bound, error_bound; simpl. rewrite Rplus_0_r, Rminus_0_r, Rabs_R0.
    repeat split; try assumption; right; field.
  - rewrite !Rplus_0_l in *. simpl Nat.add in *. unfold summed.
    pose proof (power_at_least_one (length terms)). pose proof u_positive.
    pose proof (powers_grow (length terms) (length terms + 2) ltac:(lia)).
    assert (L : 0 <= low_bound S G b g f n S).
    { unfold low_bound. assert (0 <= G) by lra. assert (0 <= u * (G * S)) by (apply Rmult_le_pos; [lra | apply Rmult_le_pos; lra]).
      assert (0 <= n) by apply pos_INR.
      assert (0 <= n * (u * (G * S) + b + f)) by (apply Rmult_le_pos; lra).
      assert (0 <= (u + g) * S) by (apply Rmult_le_pos; lra). lra. }
    repeat split.
    + exact Hx.
    + apply Rle_trans with (1 := Hh). apply Rmult_le_compat_r; lra.
    + apply Rle_trans with (1 := Hl). apply Rmult_le_compat_r; lra.
Qed.

Print Assumptions compensated. (* error bound of a double-double sum of n terms, by induction on n *)

(* The terms of both loops: x = hi + lo from two_sum, |lo| <= u |hi|; y = hi + lo with |hi| <= m, |lo| <= q m + z. In a row
   y is a pair from two_sum as well (m = |hi|, q = u, z = 0); over the rows y is the sum of a row. *)
Record factors := Factors { x_hi : R; x_lo : R; y_hi : R; y_lo : R; m : R }.
Definition product (t : factors) := (x_hi t + x_lo t) * (y_hi t + y_lo t).
Definition product_term (t : factors) :=
  let pe := two_product (x_hi t) (y_hi t) in
  Term (fst pe) (snd pe) (add (multiply (x_hi t) (y_lo t)) (multiply (x_lo t) (y_hi t)))
       ((1 + u) * (Rabs (x_hi t) * m t) + eta).
Definition sized (q z big : R) (t : factors) :=
  number (x_hi t) /\ number (x_lo t) /\ number (y_hi t) /\ number (y_lo t) /\ Rabs (x_hi t) <= big /\
  Rabs (x_lo t) <= u * Rabs (x_hi t) /\ Rabs (y_hi t) <= m t /\ Rabs (y_lo t) <= q * m t + z.
(* What p + e + c leaves of the product. *)
Definition rest (q z : R) (t : factors) :=
  u * (3 + u) * (Rabs (x_hi t) * (q * m t + z)) + u * (2 + u) * (u * (Rabs (x_hi t) * m t)) + 5 * eta.

Lemma eta_positive : 0 < eta.
Proof. apply bpow_gt_0. Qed.

Lemma multiply_near x y : Rabs (x * y - multiply x y) <= u * Rabs (x * y) + / 2 * eta.
Proof.
  destruct (error_N_FLT radix2 (-1074) 53 ltac:(lia) (fun z => negb (Z.even z)) (x * y)) as (d & f & Hd & Hf & _ & E).
  change (FLT_exp (-1074) 53) with fexp in E. unfold multiply. rewrite E.
  replace (x * y - (x * y * (1 + d) + f)) with (- d * (x * y) + - f) by ring.
  apply Rle_trans with (1 := Rabs_triang _ _). rewrite Rabs_mult, !Rabs_Ropp.
  apply Rplus_le_compat; [| exact Hf]. apply Rmult_le_compat_r; [apply Rabs_pos | exact Hd].
Qed.

Lemma multiply_size x y a : Rabs (x * y) <= a -> Rabs (multiply x y) <= (1 + u) * a + / 2 * eta.
Proof.
  intro H. replace (multiply x y) with (x * y - (x * y - multiply x y)) by ring.
  apply Rle_trans with (1 := Rabs_triang _ _). rewrite Rabs_Ropp.
  pose proof (multiply_near x y). pose proof u_positive.
  assert (u * Rabs (x * y) <= u * a) by (apply Rmult_le_compat_l; lra). lra.
Qed.

Section Products.
Variables (q z big : R).
Hypotheses (q_positive : 0 <= q) (z_positive : 0 <= z).
Let g := (1 + u) * (q + u).
Let f := (1 + u) * (1 + u) * (big * z) + 2 * eta.

Lemma product_fits t : sized q z big t ->
  fits (4 * eta) g f (product_term t) /\
  Rabs (product t - (p (product_term t) + e (product_term t) + c (product_term t))) <= rest q z t.
Proof.
  intros (Fx & Fxl & Fy & Fyl & Hbig & Hxl & Hy & Hyl).
  pose proof u_positive as Hu. pose proof eta_positive as He.
  assert (u1 : u <= 1) by (rewrite u_value; lra).
  set (X := Rabs (x_hi t)) in *. set (Y := m t) in *.
  assert (HX : 0 <= X) by apply Rabs_pos.
  assert (HY : 0 <= Y) by (apply Rle_trans with (2 := Hy); apply Rabs_pos).
  assert (XY : 0 <= X * Y) by (apply Rmult_le_pos; assumption).
  set (T := X * (q * Y + z)). set (V := u * (X * Y)).
  assert (qY : 0 <= q * Y) by (apply Rmult_le_pos; assumption).
  assert (HT : 0 <= T) by (apply Rmult_le_pos; lra).
  assert (HV : 0 <= V) by (apply Rmult_le_pos; lra).
  assert (B0 : Rabs (x_hi t * y_hi t) <= X * Y).
  { rewrite Rabs_mult. apply Rmult_le_compat; try apply Rabs_pos; [right; reflexivity | exact Hy]. }
  assert (B1 : Rabs (x_hi t * y_lo t) <= T).
  { rewrite Rabs_mult. apply Rmult_le_compat; try apply Rabs_pos; [right; reflexivity | exact Hyl]. }
  assert (B2 : Rabs (x_lo t * y_hi t) <= V).
  { rewrite Rabs_mult. unfold V. rewrite <- Rmult_assoc.
    apply Rmult_le_compat; try apply Rabs_pos; assumption. }
  assert (B3 : Rabs (x_lo t * y_lo t) <= u * T).
  { rewrite Rabs_mult. unfold T. rewrite <- Rmult_assoc.
    apply Rmult_le_compat; try apply Rabs_pos; assumption. }
  set (k1 := multiply (x_hi t) (y_lo t)). set (k2 := multiply (x_lo t) (y_hi t)).
  assert (F1 : number k1) by apply number_round. assert (F2 : number k2) by apply number_round.
  assert (E1 : Rabs (x_hi t * y_lo t - k1) <= u * T + / 2 * eta).
  { apply Rle_trans with (1 := multiply_near _ _). apply Rplus_le_compat_r. apply Rmult_le_compat_l; lra. }
  assert (E2 : Rabs (x_lo t * y_hi t - k2) <= u * V + / 2 * eta).
  { apply Rle_trans with (1 := multiply_near _ _). apply Rplus_le_compat_r. apply Rmult_le_compat_l; lra. }
  assert (S12 : Rabs (k1 + k2) <= (1 + u) * (T + V) + eta).
  { apply Rle_trans with (1 := Rabs_triang _ _).
    pose proof (multiply_size _ _ _ B1). pose proof (multiply_size _ _ _ B2). unfold k1, k2. lra. }
  set (k := add k1 k2).
  assert (E3 : Rabs (k1 + k2 - k) <= u * ((1 + u) * (T + V) + eta)).
  { apply Rle_trans with (1 := add_near k1 k2 F1 F2). apply Rmult_le_compat_l; lra. }
  assert (S3 : Rabs k <= (1 + u) * ((1 + u) * (T + V) + eta)).
  { apply Rle_trans with (1 := add_size k1 k2 F1 F2). apply Rmult_le_compat_l; lra. }
  pose proof (two_product_underflow (x_hi t) (y_hi t) Fx Fy) as D.
  set (pp := fst (two_product (x_hi t) (y_hi t))) in *. set (ee := snd (two_product (x_hi t) (y_hi t))) in *.
  assert (Sp : Rabs pp <= (1 + u) * (X * Y) + / 2 * eta) by exact (multiply_size _ _ _ B0).
  assert (Ep : Rabs (x_hi t * y_hi t - pp) <= u * (X * Y) + / 2 * eta).
  { apply Rle_trans with (1 := multiply_near _ _). apply Rplus_le_compat_r. apply Rmult_le_compat_l; lra. }
  assert (uV : 0 <= u * V) by (apply Rmult_le_pos; lra).
  assert (uT : 0 <= u * T) by (apply Rmult_le_pos; lra).
  assert (ueta : u * eta <= / 4 * eta) by (apply Rmult_le_compat_r; [lra | rewrite u_value; lra]).
  assert (ueta0 : 0 <= u * eta) by (apply Rmult_le_pos; lra).
  split.
  - unfold fits, product_term; cbv zeta; simpl p; simpl e; simpl c; simpl weight. fold pp ee k1 k2 k X Y.
    assert (Fk : number k) by apply number_round.
    repeat split; try apply number_round.
    + change (Rabs pp <= (1 + u) * (X * Y) + eta). lra.
    + change (Rabs ee <= u * ((1 + u) * (X * Y) + eta) + 4 * eta).
      replace ee with ((x_hi t * y_hi t - pp) - (x_hi t * y_hi t - (pp + ee))) by ring.
      apply Rle_trans with (1 := Rabs_triang _ _). rewrite Rabs_Ropp.
      replace (u * ((1 + u) * (X * Y) + eta)) with (u * (X * Y) + u * V + u * eta) by (unfold V; ring). lra.
    + change (Rabs k <= g * ((1 + u) * (X * Y) + eta) + f). apply Rle_trans with (1 := S3).
      assert (Q : X * z <= big * z) by (apply Rmult_le_compat_r; assumption).
      assert (Q1 : (1 + u) * (1 + u) * (X * z) <= (1 + u) * (1 + u) * (big * z))
        by (apply Rmult_le_compat_l; [apply Rmult_le_pos; lra | exact Q]).
      assert (Q2 : 0 <= (q + u) * eta) by (apply Rmult_le_pos; lra).
      assert (Q3 : 0 <= u * ((q + u) * eta)) by (apply Rmult_le_pos; lra).
      unfold g, f, T, V.
      replace ((1 + u) * ((1 + u) * (X * (q * Y + z) + u * (X * Y)) + eta)) with
        ((1 + u) * (1 + u) * (X * z) + ((1 + u) * (q + u)) * ((1 + u) * (X * Y)) + (1 + u) * eta) by ring.
      replace ((1 + u) * (q + u) * ((1 + u) * (X * Y) + eta)) with
        ((1 + u) * (q + u) * ((1 + u) * (X * Y)) + ((q + u) * eta + u * ((q + u) * eta))) by ring.
      lra.
  - unfold product, product_term; cbv zeta; simpl p; simpl e; simpl c. fold pp ee k1 k2 k.
    change (Rabs ((x_hi t + x_lo t) * (y_hi t + y_lo t) - (pp + ee + k)) <= rest q z t).
    replace ((x_hi t + x_lo t) * (y_hi t + y_lo t) - (pp + ee + k)) with
      ((x_hi t * y_hi t - (pp + ee)) + ((x_hi t * y_lo t - k1) + ((x_lo t * y_hi t - k2) + ((k1 + k2 - k) + x_lo t * y_lo t))))
      by ring.
    apply Rle_trans with (7 / 2 * eta + ((u * T + / 2 * eta) + ((u * V + / 2 * eta) +
      (u * ((1 + u) * (T + V) + eta) + u * T)))).
    { apply Rle_trans with (1 := Rabs_triang _ _). apply Rplus_le_compat; [exact D |].
      apply Rle_trans with (1 := Rabs_triang _ _). apply Rplus_le_compat; [exact E1 |].
      apply Rle_trans with (1 := Rabs_triang _ _). apply Rplus_le_compat; [exact E2 |].
      apply Rle_trans with (1 := Rabs_triang _ _). apply Rplus_le_compat; [exact E3 | exact B3]. }
    unfold rest. fold X Y T V.
    replace (u * (3 + u) * T) with (3 * (u * T) + u * (u * T)) by ring.
    replace (u * (2 + u) * V) with (2 * (u * V) + u * (u * V)) by ring.
    replace (u * ((1 + u) * (T + V) + eta)) with (u * T + u * V + u * (u * T) + u * (u * V) + u * eta) by ring.
    lra.
Qed.

Definition total (f : factors -> R) (l : list factors) := fold_right (fun t rest => f t + rest) 0 l.

(* A loop of `gain`: the sum of the products of n pairs in double-double, against the sum in real arithmetic. *)
Theorem loop_error l G :
  let terms := map product_term l in let n := INR (length l) in let S := weights terms in
  Forall (sized q z big) l -> 0 <= big -> (1 + u) ^ (length l + 2) <= G ->
  Rabs (total product l - (fst (summed terms) + snd (summed terms)))
    <= error_bound S G (4 * eta) g f n S + total (rest q z) l /\
  Rabs (fst (summed terms)) <= G * S /\
  Rabs (snd (summed terms)) <= G * low_bound S G (4 * eta) g f n S.
Proof.
  intros terms n S HF Hbig HG.
  pose proof u_positive as Hu. pose proof eta_positive as He.
  assert (N : length terms = length l) by apply map_length.
  assert (Hg : 0 <= g) by (apply Rmult_le_pos; lra).
  assert (Hf : 0 <= f).
  { assert (0 <= big * z) by (apply Rmult_le_pos; assumption).
    assert (0 <= (1 + u) * (1 + u) * (big * z)) by (apply Rmult_le_pos; [apply Rmult_le_pos; lra | assumption]).
    unfold f. lra. }
  assert (FT : Forall (fits (4 * eta) g f) terms).
  { apply Forall_map. apply Forall_impl with (2 := HF). intros t Ht. apply (product_fits t Ht). }
  destruct (compensated terms G (4 * eta) g f) as (Hx & Hh & Hl); try assumption; try lra.
  { rewrite N. exact HG. }
  rewrite N in Hx, Hl. repeat split; try assumption.
  assert (D : Rabs (total product l - exact terms) <= total (rest q z) l).
  { unfold terms; clear - HF q_positive z_positive g f. induction l as [| t l IH]; simpl.
    - rewrite Rminus_0_r, Rabs_R0. lra.
    - inversion HF as [| t' l' Ht Hl]; subst. specialize (IH Hl).
      pose proof (proj2 (product_fits t Ht)) as P. simpl p in P; simpl e in P; simpl c in P.
      match goal with |- Rabs (_ + _ - (?s + _)) <= _ =>
        replace (product t + total product l - (s + exact (map product_term l))) with
          ((product t - s) + (total product l - exact (map product_term l))) by ring end.
      apply Rle_trans with (1 := Rabs_triang _ _). apply Rplus_le_compat; assumption. }
  replace (total product l - (fst (summed terms) + snd (summed terms))) with
    ((exact terms - (fst (summed terms) + snd (summed terms))) + (total product l - exact terms)) by ring.
  apply Rle_trans with (1 := Rabs_triang _ _). apply Rplus_le_compat; assumption.
Qed.
End Products.

(* A sum of two numbers that is at most 0 as computed is at most 0. *)
Theorem sign_kept x y : number x -> number y -> add x y <= 0 -> x + y <= 0.
Proof.
  intros Fx Fy H. apply Rnot_lt_le. intro L. pose proof (add_near x y Fx Fy) as N.
  rewrite (Rabs_pos_eq (x + y)) in N by lra.
  assert (u * (x + y) < 1 * (x + y)) by (apply Rmult_lt_compat_r; [exact L | rewrite u_value; lra]).
  pose proof (Rle_abs (x + y - add x y)). lra.
Qed.

(* The acceptance of a candidate: high + (low + radius) <= 0 as computed. *)
Theorem accepted_never_gains gamma high low radius :
  number high -> number low -> number radius ->
  Rabs (gamma - (high + low)) + u * Rabs (low + radius) <= radius ->
  add high (add low radius) <= 0 -> gamma <= 0.
Proof.
  intros Fh Fl Fr B H.
  apply sign_kept in H; [| assumption | apply number_round].
  pose proof (add_near low radius Fl Fr) as N.
  pose proof (Rle_abs (gamma - (high + low))). pose proof (Rle_abs (low + radius - add low radius)). lra.
Qed.

Print Assumptions loop_error. (* error and size of either loop of `gain`, a double-double sum of n products of
   pairs *)
Print Assumptions sign_kept. (* if a computed sum is at most 0, the exact sum is at most 0 *)
Print Assumptions accepted_never_gains. (* if the computed high + (low + radius) ≤ 0 and the radius bounds the
   error, then Γ ≤ 0 *)

(* `gain` itself: rows of factors, one for each coordinate, and the double-double d of its change of velocity. *)
Record row := Row { d_hi : R; d_lo : R; entries : list factors }.
Definition row_sum (r : row) := summed (map product_term (entries r)).
Definition row_weight (r : row) := weights (map product_term (entries r)).
Fixpoint gamma (rows : list row) :=
  match rows with [] => 0 | r :: others => (d_hi r + d_lo r) * total product (entries r) + gamma others end.

Lemma fold_numbers terms : forall state, number (fst state) -> number (snd state) ->
  number (fst (fold_left step terms state)) /\ number (snd (fold_left step terms state)).
Proof.
  induction terms as [| y terms IH]; intros state Fh Fl; simpl; [split; assumption |].
  apply IH; apply number_round.
Qed.

Lemma summed_numbers terms : number (fst (summed terms)) /\ number (snd (summed terms)).
Proof. apply fold_numbers; apply generic_format_0. Qed.

Section Gain.
Variables (G A D : R) (d : nat).
Hypotheses (G_large : (1 + u) ^ (d + 2) <= G) (A_positive : 0 <= A) (D_positive : 0 <= D).

Definition row_fits (r : row) :=
  length (entries r) = d /\ Forall (sized u 0 A) (entries r) /\
  number (d_hi r) /\ number (d_lo r) /\ Rabs (d_hi r) <= D /\ Rabs (d_lo r) <= u * Rabs (d_hi r).
Definition outer (r : row) := Factors (d_hi r) (d_lo r) (fst (row_sum r)) (snd (row_sum r)) (G * row_weight r).

Let n := INR d.
Let g1 := (1 + u) * (u + u).
Let f1 := (1 + u) * (1 + u) * (A * 0) + 2 * eta.
Let q2 := n * (u * G) + (u + g1).
Let z2 := G * (n * (4 * eta + f1)).
Let g2 := (1 + u) * (q2 + u).
Let f2 := (1 + u) * (1 + u) * (D * z2) + 2 * eta.
Definition row_error (r : row) :=
  error_bound (row_weight r) G (4 * eta) g1 f1 n (row_weight r) + total (rest u 0) (entries r).
Fixpoint rows_error (rows : list row) :=
  match rows with [] => 0 | r :: others => Rabs (d_hi r + d_lo r) * row_error r + rows_error others end.

Theorem gain_error rows :
  let terms := map product_term (map outer rows) in let S := weights terms in
  length rows = d -> Forall row_fits rows ->
  Rabs (gamma rows - (fst (summed terms) + snd (summed terms)))
    <= error_bound S G (4 * eta) g2 f2 n S + total (rest q2 z2) (map outer rows) + rows_error rows /\
  Rabs (snd (summed terms)) <= G * low_bound S G (4 * eta) g2 f2 n S.
Proof.
  intros terms S Hd HF.
  pose proof u_positive as Hu. pose proof eta_positive as He.
  assert (n_positive : 0 <= n) by apply pos_INR.
  assert (G1 : 1 <= G) by (apply Rle_trans with (2 := G_large); apply power_at_least_one).
  assert (f1_positive : 0 <= f1) by (unfold f1; rewrite Rmult_0_r, Rmult_0_r; lra).
  assert (g1_positive : 0 <= g1) by (apply Rmult_le_pos; lra).
  assert (q2_positive : 0 <= q2).
  { assert (0 <= u * G) by (apply Rmult_le_pos; lra).
    assert (0 <= n * (u * G)) by (apply Rmult_le_pos; assumption). unfold q2. lra. }
  assert (z2_positive : 0 <= z2).
  { apply Rmult_le_pos; [lra |]. apply Rmult_le_pos; [assumption | lra]. }
  assert (One : forall r, row_fits r ->
    sized q2 z2 D (outer r) /\
    Rabs (total product (entries r) - (fst (row_sum r) + snd (row_sum r))) <= row_error r).
  { intros r (Hn & He' & Fd & Fdl & HD & Hdl).
    destruct (loop_error u 0 A ltac:(lra) ltac:(lra) (entries r) G He' A_positive) as (Hx & Hh & Hl).
    { rewrite Hn. exact G_large. }
    rewrite Hn in Hx, Hl. fold n in Hx, Hl. split; [| exact Hx].
    destruct (summed_numbers (map product_term (entries r))) as (Fh & Fl).
    unfold sized, outer; simpl x_hi; simpl x_lo; simpl y_hi; simpl y_lo; simpl m.
    repeat split; try assumption.
    apply Rle_trans with (1 := Hl). right. unfold low_bound, q2, z2. fold g1 f1. fold (row_weight r). ring. }
  assert (HO : Forall (sized q2 z2 D) (map outer rows)).
  { apply Forall_map. apply Forall_impl with (2 := HF). intros r Hr. apply (One r Hr). }
  destruct (loop_error q2 z2 D q2_positive z2_positive (map outer rows) G HO D_positive) as (Hx & _ & Low).
  { rewrite map_length, Hd. exact G_large. }
  rewrite map_length, Hd in Hx, Low. fold n g2 f2 terms S in Hx, Low. split; [| exact Low].
  assert (Rest : Rabs (gamma rows - total product (map outer rows)) <= rows_error rows).
  { clear - HF One. induction rows as [| r rows IH]; simpl.
    - rewrite Rminus_0_r, Rabs_R0. lra.
    - inversion HF as [| r' rows' Hr Hrows]; subst. specialize (IH Hrows). destruct (One r Hr) as (_ & E).
      change (product (outer r)) with ((d_hi r + d_lo r) * (fst (row_sum r) + snd (row_sum r))).
      replace ((d_hi r + d_lo r) * total product (entries r) + gamma rows -
               ((d_hi r + d_lo r) * (fst (row_sum r) + snd (row_sum r)) + total product (map outer rows))) with
        ((d_hi r + d_lo r) * (total product (entries r) - (fst (row_sum r) + snd (row_sum r))) +
         (gamma rows - total product (map outer rows))) by ring.
      apply Rle_trans with (1 := Rabs_triang _ _). apply Rplus_le_compat; [| exact IH].
      rewrite Rabs_mult. apply Rmult_le_compat_l; [apply Rabs_pos | exact E]. }
  replace (gamma rows - (fst (summed terms) + snd (summed terms))) with
    ((total product (map outer rows) - (fst (summed terms) + snd (summed terms))) +
     (gamma rows - total product (map outer rows))) by ring.
  apply Rle_trans with (1 := Rabs_triang _ _). apply Rplus_le_compat; assumption.
Qed.
End Gain.

Print Assumptions gain_error. (* error of `gain`: |Γ − (high + low)| is at most the sum of the bounds of its
   rows and of their sum *)

(* What the code puts in: (M_ij + M_ji) (w_j + v_j) of a row, and w_i - v_i, are exact and meet the hypotheses above. *)
Definition entry (a b w v : R) :=
  Factors (fst (two_sum a b)) (snd (two_sum a b)) (fst (two_sum w v)) (snd (two_sum w v)) (Rabs (fst (two_sum w v))).

Theorem entry_fits a b w v A : number a -> number b -> number w -> number v -> Rabs (add a b) <= A ->
  sized u 0 A (entry a b w v) /\ product (entry a b w v) = (a + b) * (w + v).
Proof.
  intros Fa Fb Fw Fv HA. split.
  - unfold sized, entry; simpl x_hi; simpl x_lo; simpl y_hi; simpl y_lo; simpl m. rewrite Rplus_0_r.
    repeat split; try apply number_round; try assumption; try apply two_sum_low; try assumption. right. reflexivity.
  - change (product (entry a b w v)) with
      ((fst (two_sum a b) + snd (two_sum a b)) * (fst (two_sum w v) + snd (two_sum w v))).
    rewrite !two_sum_exact by assumption. reflexivity.
Qed.

Print Assumptions entry_fits. (* the terms that the code adds, (Mᵢⱼ + Mⱼᵢ)(wⱼ + vⱼ), are exact and meet the
   hypotheses of gain_error *)
